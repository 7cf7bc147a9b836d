//! FLAC files as planar `f32`.

use crate::wav::{Wav, check_rate};
use crate::{FileError, file, narrow};
use claxon::FlacReader;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Reads a whole FLAC file of up to `max_samples` samples of all channels together.
///
/// # Errors
/// A file that is missing, damaged, cut short or too long, or a rate outside [`crate::wav::SAMPLE_RATES_HZ`]. The message names
/// the file.
pub fn read_limited(path: &Path, max_samples: u64) -> Result<Wav, FileError> {
    let unreadable = |source: claxon::Error| match source {
        claxon::Error::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => FileError::read(path)(source),
        source => FileError::unreadable(path, "FLAC file", source),
    };
    let mut file = file::open(path).map_err(FileError::read(path))?;
    let (size, stated) = metadata_end(&mut file).map_err(FileError::read(path))?;
    if stated > size {
        return Err(FileError::content(
            path,
            format!("metadata within the file's {size} bytes"),
            format!("{stated} bytes of it"),
        ));
    }
    let mut reader = FlacReader::new(BufReader::new(file)).map_err(unreadable)?;
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

/// Size of a file, and where its blocks of metadata end as they say themselves, bytes. The decoder asks for memory by what they
/// say.
fn metadata_end(file: &mut File) -> io::Result<(u64, u64)> {
    let size = file.seek(SeekFrom::End(0))?;
    // After the mark "fLaC" each block has four bytes of its own: whether it is the last, its kind, its length (RFC 9639,
    // section 8.1).
    let (mut end, mut mark) = (4, Vec::new());
    file.rewind()?;
    file.by_ref().take(end).read_to_end(&mut mark)?;
    while mark == b"fLaC" && end + 4 <= size {
        file.seek(SeekFrom::Start(end))?;
        let mut header = [0; 4];
        file.read_exact(&mut header)?;
        let [kind, high, middle, low] = header;
        end += 4 + u64::from(u32::from_be_bytes([0, high, middle, low]));
        if kind & 0x80 != 0 {
            break;
        }
    }
    file.rewind()?;
    Ok((size, if mark == b"fLaC" { end } else { 0 }))
}
