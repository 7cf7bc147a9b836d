//! A whole file as bytes, if it is not too long for a mesh.

use crate::error::AcousticsError;
use std::path::Path;

/// Largest file of a mesh, bytes.
const MAX_FILE_BYTES: u64 = 1 << 30;

pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, AcousticsError> {
    let size = std::fs::metadata(path).map_err(AcousticsError::read(path))?.len();
    if size > MAX_FILE_BYTES {
        return Err(AcousticsError::content(path, format!("at most {MAX_FILE_BYTES} bytes"), size));
    }
    std::fs::read(path).map_err(AcousticsError::read(path))
}
