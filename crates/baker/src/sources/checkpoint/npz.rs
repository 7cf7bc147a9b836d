//! Arrays of floats from NumPy's .npz: a zip archive of .npy files.

use crate::BakeError;
use promenade_audio::npy::Array;
use promenade_core::network::Tensor;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// Bytes that one array may have.
const MAX_ARRAY_BYTES: u64 = 256 << 20;

/// Reads the arrays that are `wanted`, with the names of all.
pub(super) fn read(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<(BTreeMap<String, Tensor>, Vec<String>), BakeError> {
    let unreadable = |e: zip::result::ZipError| BakeError::unreadable(path, ".npz file", e);
    let file = File::open(path).map_err(BakeError::read(path))?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(unreadable)?;
    let files = archive.file_names().flatten();
    let mut names: Vec<String> = files.filter_map(|n| n.strip_suffix(".npy").map(str::to_owned)).collect();
    names.sort();
    let mut arrays = BTreeMap::new();
    for name in names.iter().filter(|n| wanted(n)) {
        let entry = archive.by_name(&format!("{name}.npy")).map_err(unreadable)?;
        let mut bytes = Vec::new();
        entry.take(MAX_ARRAY_BYTES + 1).read_to_end(&mut bytes).map_err(|e| unreadable(e.into()))?;
        let wrong =
            |found: String| BakeError::entry(path, format!("array '{name}'"), "rows of floats as NumPy saves them", found);
        if bytes.len() as u64 > MAX_ARRAY_BYTES {
            return Err(wrong(format!("more than {MAX_ARRAY_BYTES} bytes")));
        }
        let Array { shape, values } = Array::from_bytes(&bytes).map_err(wrong)?;
        arrays.insert(name.clone(), Tensor { shape, values: values.into_iter().map(|v| v as f32).collect() });
    }
    Ok((arrays, names))
}
