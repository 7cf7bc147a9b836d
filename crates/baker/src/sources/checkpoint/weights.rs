//! Named arrays of floats out of PyTorch checkpoints and safetensors.

use super::float::Float;
use super::form::Form;
use super::pickle;
use crate::BakeError;
use promenade_core::network::Tensor;
use pytorch_reader::{DType, PytorchError, PytorchReader};
use safetensors::{Dtype, SafeTensors};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// Bytes of the pickle inside an archive: a published one has some 30 kB, and a pickle can ask for 90 times its size in memory.
const MAX_PICKLE_BYTES: u64 = 2 << 20;
/// Bytes of all weights together, which views of one storage could multiply.
const MAX_WEIGHT_BYTES: usize = 1 << 30;
/// What a checkpoint must be.
const EXPECTED: &str = "a PyTorch checkpoint or the .safetensors that export_avcloud.py writes";

/// What is in a file.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub(super) weights: BTreeMap<String, Tensor>,
    /// Names of all arrays, also of those that were not wanted.
    pub(super) names: Vec<String>,
    /// Key and value pairs of a safetensors file.
    pub(super) metadata: BTreeMap<String, String>,
    /// How many arrays were not `f32`.
    pub(super) converted: usize,
}

impl Stored {
    /// Reads a checkpoint.
    pub(super) fn read(path: &Path) -> Result<Self, BakeError> {
        let stored = match Form::of(path, EXPECTED)? {
            Form::Safetensors => safetensors(path, |_| true)?,
            Form::Zip => {
                check_archive(path)?;
                pytorch(path)?
            }
            Form::Pickle => {
                pickle::check(path)?;
                pytorch(path)?
            }
        };
        if stored.weights.is_empty() {
            return Err(BakeError::content(path, "weights under \"state_dict\" or by themselves", "none"));
        }
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

/// A safetensors file; only what is `wanted` is converted.
pub(super) fn safetensors(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<Stored, BakeError> {
    let unreadable = |e: safetensors::SafeTensorError| BakeError::unreadable(path, ".safetensors file", e);
    let bytes = std::fs::read(path).map_err(BakeError::read(path))?;
    let (_, header) = SafeTensors::read_metadata(&bytes).map_err(unreadable)?;
    let file = SafeTensors::deserialize(&bytes).map_err(unreadable)?;
    let metadata = header.metadata().iter().flatten().map(|(k, v)| (k.clone(), v.clone())).collect();
    let mut stored = Stored { metadata, ..Stored::default() };
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
            other => return Err(no_floats(path, name, &other)),
        };
        stored.insert(path, name, view.shape(), float, view.data())?;
    }
    stored.names.sort();
    Ok(stored)
}

/// A checkpoint as `torch.save` writes it. Its pickle is parsed, never run.
fn pytorch(path: &Path) -> Result<Stored, BakeError> {
    let unreadable = |e: PytorchError| BakeError::unreadable(path, "PyTorch checkpoint", e);
    let reader = match PytorchReader::with_top_level_key(path, "state_dict") {
        Err(PytorchError::KeyNotFound(_)) => PytorchReader::new(path).map_err(unreadable)?,
        nested => nested.map_err(unreadable)?,
    };
    let total = reader.tensors().values().fold(0_usize, |sum, t| sum.saturating_add(t.byte_len()));
    if total > MAX_WEIGHT_BYTES {
        return Err(BakeError::content(path, format!("at most {MAX_WEIGHT_BYTES} bytes of weights"), total));
    }
    let mut stored = Stored::default();
    for (name, tensor) in reader.tensors() {
        let float = match tensor.dtype() {
            DType::F64 => Float::F64,
            DType::F32 => Float::F32,
            DType::F16 => Float::F16,
            DType::BF16 => Float::Bf16,
            other => return Err(no_floats(path, name, &other)),
        };
        let bytes = tensor.read().map_err(|e| BakeError::unreadable(path, "PyTorch checkpoint", e))?;
        stored.insert(path, name, tensor.shape(), float, &bytes)?;
        stored.names.push(name.clone());
    }
    stored.names.sort();
    Ok(stored)
}

/// Looks at the sizes that an archive declares for its pickles before one is unpacked, and whether storages have the lengths
/// that the pickle declares: bytes of another format would else be read as numbers.
fn check_archive(path: &Path) -> Result<(), BakeError> {
    let unreadable = |e: zip::result::ZipError| BakeError::unreadable(path, "PyTorch checkpoint", e);
    let file = File::open(path).map_err(BakeError::read(path))?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(unreadable)?;
    let (mut sizes, mut pickles) = (BTreeMap::new(), Vec::new());
    for i in 0..archive.len() {
        let entry = archive.by_index_raw(i).map_err(unreadable)?;
        let name = entry.name().map_err(unreadable)?.into_owned();
        if name.ends_with(".pkl") && entry.size() > MAX_PICKLE_BYTES {
            let expected = format!("at most {MAX_PICKLE_BYTES} bytes");
            return Err(BakeError::entry(path, name, expected, entry.size()));
        }
        pickles.extend(name.strip_suffix("data.pkl").map(str::to_owned));
        sizes.insert(name, entry.size());
    }
    for root in pickles {
        let entry = archive.by_name(&format!("{root}data.pkl")).map_err(unreadable)?;
        let mut pickle = Vec::new();
        entry.take(MAX_PICKLE_BYTES).read_to_end(&mut pickle).map_err(|e| unreadable(e.into()))?;
        for (key, declared) in pickle::storages(&pickle) {
            let name = format!("{root}data/{key}");
            if let Some(found) = sizes.get(&name).filter(|found| **found != declared) {
                let expected = format!("a storage of {declared} bytes, as the pickle declares");
                return Err(BakeError::entry(path, name, expected, format!("{found} bytes")));
            }
        }
    }
    Ok(())
}

fn no_floats(path: &Path, name: &str, found: &dyn std::fmt::Debug) -> BakeError {
    BakeError::entry(path, format!("weights '{name}'"), "floats of 16, 32 or 64 bits", format!("{found:?}"))
}
