//! Files and folders as every source reads them.

use crate::{BakeError, file, sound};
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// The whole content of a regular file of at most `most` bytes.
pub(super) fn bytes(path: &Path, most: u64) -> Result<Vec<u8>, BakeError> {
    file::read(path, most).map_err(BakeError::read(path))
}

/// What a JSON file of at most `most` bytes holds.
pub(super) fn json<T: DeserializeOwned>(path: &Path, most: u64) -> Result<T, BakeError> {
    serde_json::from_slice(&bytes(path, most)?).map_err(BakeError::json(path))
}

/// Ending of a name in small letters.
pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// The files and folders of a folder, by name.
pub(super) fn entries(folder: &Path) -> Result<Vec<PathBuf>, BakeError> {
    let list = std::fs::read_dir(folder).map_err(BakeError::read(folder))?;
    let mut all = list.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>().map_err(BakeError::read(folder))?;
    all.sort();
    Ok(all)
}

/// The sound files of a folder, by name.
pub(super) fn sounds(folder: &Path) -> Result<Vec<PathBuf>, BakeError> {
    Ok(entries(folder)?.into_iter().filter(|p| sound::ENDINGS.contains(&ending(p).as_str())).collect())
}
