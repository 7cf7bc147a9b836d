//! FLAC files as planar `f32`.

use crate::wav::{Wav, check_rate};
use crate::{FileError, file, narrow};
use claxon::FlacReader;
use std::path::Path;

/// Reads a whole FLAC file of up to `max_samples` samples of all channels together.
///
/// # Errors
/// A file that is missing, damaged, cut short or too long, or a rate outside [`crate::wav::SAMPLE_RATES_HZ`]. The message names the file.
pub fn read_limited(path: &Path, max_samples: u64) -> Result<Wav, FileError> {
    let unreadable = |source: claxon::Error| match source {
        claxon::Error::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => FileError::read(path)(source),
        source => FileError::Flac { path: path.to_path_buf(), source },
    };
    let file = file::open(path).map_err(FileError::read(path))?;
    let mut reader = FlacReader::new(std::io::BufReader::new(file)).map_err(unreadable)?;
    let info = reader.streaminfo();
    check_rate(path, info.sample_rate)?;
    let too_long = |samples: u64| FileError::content(path, format!("at most {max_samples} samples"), format!("{samples}"));
    let count = info.channels as usize;
    if let Some(samples) = info.samples.map(|frames| frames.saturating_mul(u64::from(info.channels)))
        && samples > max_samples
    {
        return Err(too_long(samples));
    }
    let scale = 0.5_f64.powi(info.bits_per_sample.try_into().unwrap_or(i32::MAX) - 1);
    let mut channels = vec![Vec::new(); count];
    let mut blocks = reader.blocks();
    let mut buffer = Vec::new();
    while let Some(block) = blocks.read_next_or_eof(buffer).map_err(unreadable)? {
        // Frames have a count of their own.
        if block.channels() != info.channels {
            let expected = format!("{count} channels in all frames");
            return Err(FileError::content(path, expected, format!("a frame of {}", block.channels())));
        }
        for (channel, samples) in channels.iter_mut().enumerate() {
            let block = block.channel(u32::try_from(channel).unwrap_or(u32::MAX));
            samples.extend(block.iter().map(|v| narrow(f64::from(*v) * scale)));
        }
        // A stream need not declare its length.
        let found = (channels.len() * channels[0].len()) as u64;
        if found > max_samples {
            return Err(too_long(found));
        }
        buffer = block.into_buffer();
    }
    let frames = channels.first().map_or(0, Vec::len) as u64;
    match info.samples {
        Some(expected) if expected > 0 && expected != frames => {
            Err(FileError::content(path, format!("{expected} samples, as its header says"), format!("{frames}")))
        }
        _ if frames == 0 => Err(FileError::content(path, "at least one sample", "none")),
        _ => Ok(Wav { sample_rate_hz: info.sample_rate, channels }),
    }
}
