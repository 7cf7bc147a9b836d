//! Sound files of any kind that is read, whole, as planar `f32`.

use crate::pcm::PcmReader;
use crate::{FileError, file, flac};
use std::path::Path;

pub use crate::samples::{SAMPLE_RATES_HZ, Sound};

/// Samples of all channels that [`read`] takes into memory: 3.1 hours of stereo at 48 kHz, a long film; 4 GiB of `f32`.
pub const MAX_SAMPLES: u64 = 1 << 30;
/// Endings of names of files that are read.
pub const ENDINGS: [&str; 5] = ["wav", "flac", "aif", "aiff", "aifc"];

/// Whether a file's content begins as FLAC, perhaps after an ID3 tag.
///
/// # Errors
/// A file that cannot be read.
pub fn is_flac(path: &Path) -> Result<bool, FileError> {
    let mut file = file::open(path).map_err(FileError::read(path))?;
    flac::start(&mut file).map(|start| start.is_some()).map_err(FileError::read(path))
}

/// Reads a whole file: FLAC, WAV (RIFF, RF64 or BW64) or AIFF, whatever its name, of any number of channels.
///
/// # Errors
/// A file that is missing, no regular file, empty, damaged, cut short or holds more than [`MAX_SAMPLES`] samples; a rate
/// outside [`SAMPLE_RATES_HZ`]; a sample that is not finite. The message names the file, what was expected and what was found.
pub fn read(path: &Path) -> Result<Sound, FileError> {
    read_limited(path, MAX_SAMPLES)
}

/// [`read`] with another limit on the samples of all channels together.
///
/// # Errors
/// Those of [`read`], with the other limit.
pub fn read_limited(path: &Path, max_samples: u64) -> Result<Sound, FileError> {
    if is_flac(path)? {
        return flac::read_limited(path, max_samples);
    }
    let mut reader = PcmReader::open(path)?;
    let samples = u64::from(reader.frames()) * u64::from(reader.channels());
    if samples > max_samples {
        return Err(FileError::content(path, format!("at most {max_samples} samples"), format!("{samples}")));
    }
    let mut channels = vec![Vec::new(); usize::from(reader.channels())];
    reader.read(reader.frames() as usize, &mut channels)?;
    Ok(Sound { sample_rate_hz: reader.sample_rate_hz(), channels })
}
