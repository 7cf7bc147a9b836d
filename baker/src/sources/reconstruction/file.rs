//! Files of a place's shape.

use crate::BakeError;
use crate::sources::file;
use std::path::Path;

/// Bytes that a file may have.
const MAX_BYTES: u64 = 2 << 30;

/// The whole content, whose size is checked before it is read.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, BakeError> {
    if !std::fs::metadata(path).map_err(BakeError::read(path))?.is_file() {
        return Err(BakeError::content(path, "a file", "something else"));
    }
    file::bytes(path, "", MAX_BYTES)
}
