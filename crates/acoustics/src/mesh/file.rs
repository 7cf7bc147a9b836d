//! A whole file as bytes, if it is not too long for a mesh.

use crate::error::AcousticsError;
use promenade_audio::file;
use std::path::Path;

/// Largest file of a mesh, bytes.
const MAX_FILE_BYTES: u64 = 1 << 30;

pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, AcousticsError> {
    file::read(path, MAX_FILE_BYTES).map_err(AcousticsError::read(path))
}
