//! Which kind of file it is, by its content and not by its ending.

use crate::BakeError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes that a file may have.
const MAX_BYTES: u64 = 1 << 30;

/// Forms that weights and anchors come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A zip archive: a checkpoint of PyTorch 1.6 or later, or NumPy arrays.
    Zip,
    /// A bare Python pickle: an older checkpoint, or Python objects.
    Pickle,
    /// Safetensors.
    Safetensors,
}

impl Form {
    /// Looks at the first bytes; `expected` says in an error what would have been right.
    pub(super) fn of(path: &Path, expected: &str) -> Result<Self, BakeError> {
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
        let mut start = Vec::new();
        File::open(path).and_then(|f| f.take(9).read_to_end(&mut start)).map_err(BakeError::read(path))?;
        match start[..] {
            [] => wrong("an empty file"),
            // The length of a header, which may look like the start of the others, and the header.
            [_, _, _, _, 0, 0, 0, 0, b'{'] => Ok(Self::Safetensors),
            [b'P', b'K', ..] => Ok(Self::Zip),
            [0x80, ..] => Ok(Self::Pickle),
            _ => wrong("something else"),
        }
    }
}
