//! Sound files of any kind that is read.

use crate::wav::{self, MAX_SAMPLES, Wav};
use crate::{FileError, flac};
use std::path::Path;

/// Whether a file is read as FLAC, by the end of its name.
#[must_use]
pub fn is_flac(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("flac"))
}

/// Reads a whole file: FLAC where its name ends so, or else WAV.
///
/// # Errors
/// A file that is missing, damaged or too long, or a sample that is not finite.
pub fn read(path: &Path) -> Result<Wav, FileError> {
    read_limited(path, MAX_SAMPLES)
}

/// [`read`] with another limit on the samples of all channels together.
///
/// # Errors
/// A file that is missing, damaged or too long, or a sample that is not finite.
pub fn read_limited(path: &Path, max_samples: u64) -> Result<Wav, FileError> {
    if is_flac(path) { flac::read_limited(path, max_samples) } else { wav::read_limited(path, max_samples) }
}
