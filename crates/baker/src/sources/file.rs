//! Files and folders as every source reads them.

use crate::{BakeError, file};
use serde::de::DeserializeOwned;
use std::path::Path;

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
