//! Sound files of any kind that is read.

use crate::wav::{self, MAX_SAMPLES, Wav};
use crate::{FileError, flac};
use std::path::Path;

/// Reads a whole file: FLAC where its name ends so, or else WAV.
///
/// # Errors
/// As [`wav::read`].
pub fn read(path: &Path) -> Result<Wav, FileError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("flac")) {
        flac::read_limited(path, MAX_SAMPLES)
    } else {
        wav::read(path)
    }
}
