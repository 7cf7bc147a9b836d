//! Files of a place's shape: how large they may be and what they are called.

use crate::BakeError;
use std::path::Path;

/// Bytes that a file may have.
const MAX_BYTES: u64 = 2 << 30;

/// The whole content, whose size is checked before it is read.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, BakeError> {
    let about = std::fs::metadata(path).map_err(BakeError::read(path))?;
    if !about.is_file() {
        return Err(BakeError::content(path, "a file", "something else"));
    }
    if about.len() > MAX_BYTES {
        return Err(BakeError::content(path, format!("at most {MAX_BYTES} bytes"), about.len().to_string()));
    }
    std::fs::read(path).map_err(BakeError::read(path))
}

/// Ending of a name in small letters.
pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}
