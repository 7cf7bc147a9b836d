//! Named arrays of floats out of safetensors files.

use super::float::Float;
use crate::BakeError;
use promenade_core::network::Tensor;
use safetensors::{Dtype, SafeTensors};
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes that a file may have.
const MAX_BYTES: u64 = 1 << 30;
/// What a checkpoint must be.
const EXPECTED: &str = "the .safetensors that export_avcloud.py writes";

/// What is in a file.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub(super) weights: BTreeMap<String, Tensor>,
    /// Names of all arrays, also of those that were not wanted.
    pub(super) names: Vec<String>,
    /// Key and value pairs of the file.
    pub(super) metadata: BTreeMap<String, String>,
    /// How many arrays were not `f32`.
    pub(super) converted: usize,
}

impl Stored {
    /// Reads a checkpoint.
    pub(super) fn read(path: &Path) -> Result<Self, BakeError> {
        let stored = Self::of(path, EXPECTED, |_| true)?;
        if stored.weights.is_empty() {
            return Err(BakeError::content(path, "weights", "none"));
        }
        Ok(stored)
    }

    /// Reads a safetensors file; only what is `wanted` is converted. `expected` says in an error what would have been right.
    pub(super) fn of(path: &Path, expected: &str, wanted: impl Fn(&str) -> bool) -> Result<Self, BakeError> {
        let unreadable = |e: safetensors::SafeTensorError| BakeError::unreadable(path, ".safetensors file", e);
        let bytes = content(path, expected)?;
        let (_, header) = SafeTensors::read_metadata(&bytes).map_err(unreadable)?;
        let file = SafeTensors::deserialize(&bytes).map_err(unreadable)?;
        let metadata = header.metadata().iter().flatten().map(|(k, v)| (k.clone(), v.clone())).collect();
        let mut stored = Self { metadata, ..Self::default() };
        for (name, view) in file.iter() {
            stored.names.push(name.to_owned());
            if !wanted(name) {
                continue;
            }
            let float = match view.dtype() {
                Dtype::F64 => Float::F64,
                Dtype::F32 => Float::F32,
                Dtype::F16 => Float::F16,
                Dtype::BF16 => Float::Bf16,
                other => {
                    let expected = "floats of 16, 32 or 64 bits";
                    return Err(BakeError::entry(path, format!("weights '{name}'"), expected, format!("{other:?}")));
                }
            };
            stored.insert(path, name, view.shape(), float, view.data())?;
        }
        stored.names.sort();
        Ok(stored)
    }

    fn insert(&mut self, path: &Path, name: &str, shape: &[usize], float: Float, bytes: &[u8]) -> Result<(), BakeError> {
        // Training on several devices wraps the model, and its name goes before all others.
        let name = name.strip_prefix("module.").unwrap_or(name);
        if name.ends_with(".freqs") && float.size() < size_of::<f32>() {
            let expected = "frequencies of 32 or 64 bits, since fewer turn phases";
            return Err(BakeError::entry(path, format!("weights '{name}'"), expected, "16 bits"));
        }
        let tensor = Tensor { shape: shape.to_vec(), values: float.values(bytes) };
        self.converted += usize::from(float != Float::F32);
        if self.weights.insert(name.to_owned(), tensor).is_none() {
            return Ok(());
        }
        Err(BakeError::entry(path, format!("weights '{name}'"), "one array", "two, with and without \"module.\""))
    }
}

/// The bytes of what is a safetensors file by its first ones.
fn content(path: &Path, expected: &str) -> Result<Vec<u8>, BakeError> {
    let wrong = |found: &str| Err(BakeError::content(path, expected, found));
    // Opening a pipe would wait for its writer, so what it is comes first.
    let about = std::fs::metadata(path).map_err(BakeError::read(path))?;
    if about.is_dir() {
        return wrong("a folder");
    }
    if !about.is_file() {
        return wrong("no regular file");
    }
    if about.len() > MAX_BYTES {
        return wrong(&format!("{} bytes, more than the {MAX_BYTES} that are read", about.len()));
    }
    let bytes = std::fs::read(path).map_err(BakeError::read(path))?;
    match bytes[..] {
        [] => wrong("an empty file"),
        // The length of a header, which may look like the start of the others, and the header.
        [_, _, _, _, 0, 0, 0, 0, b'{', ..] => Ok(bytes),
        [b'P', b'K', ..] | [0x80, ..] => wrong(
            "a file of PyTorch, NumPy or Python (a pickle runs as a program when it is opened): export_avcloud.py converts it",
        ),
        _ => wrong("something else"),
    }
}
