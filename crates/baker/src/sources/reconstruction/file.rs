//! Files of a place's shape.

use crate::BakeError;
use crate::sources::file;
use std::path::Path;

/// Bytes that a file may have.
const MAX_BYTES: u64 = 2 << 30;

/// The whole content of a regular file.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, BakeError> {
    file::bytes(path, MAX_BYTES)
}
