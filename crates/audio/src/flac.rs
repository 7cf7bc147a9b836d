//! FLAC files as planar `f32`.

use crate::samples::{Sound, check_rate};
use crate::{FileError, file, narrow};
use claxon::FlacReader;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Reads a whole FLAC file of up to `max_samples` samples of all channels together.
///
/// # Errors
/// A file that is missing, damaged, cut short or too long, or a rate outside [`crate::sound::SAMPLE_RATES_HZ`]. The message
/// names the file.
pub(crate) fn read_limited(path: &Path, max_samples: u64) -> Result<Sound, FileError> {
    let unreadable = |source: claxon::Error| match source {
        claxon::Error::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => FileError::read(path)(source),
        source => FileError::unreadable(path, "FLAC file", source),
    };
    let mut file = file::open(path).map_err(FileError::read(path))?;
    let ends = |file: &mut File| {
        let start = start(file)?.unwrap_or(0);
        metadata_end(file, start)
    };
    let (size, stated) = ends(&mut file).map_err(FileError::read(path))?;
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
        _ => Ok(Sound { sample_rate_hz: info.sample_rate, channels }),
    }
}

/// Where the mark "fLaC" is: at the start, or after a tag of ID3 version 2, whose size has four times seven bits (ID3v2.4.0,
/// section 3.1).
pub(crate) fn start(file: &mut File) -> io::Result<Option<u64>> {
    let mut head = [0; 10];
    let mut at = 0;
    file.rewind()?;
    if file.read_exact(&mut head).is_ok() && head.starts_with(b"ID3") {
        at = 10 + head[6..].iter().fold(0_u64, |sum, byte| sum << 7 | u64::from(byte & 0x7F));
    }
    let mut mark = Vec::new();
    file.seek(SeekFrom::Start(at))?;
    file.by_ref().take(4).read_to_end(&mut mark)?;
    Ok((mark == b"fLaC").then_some(at))
}

/// Size of a file, and where its blocks of metadata end as they say themselves, bytes; leaves the file at `start`, where FLAC
/// begins. The decoder asks for memory by what they say.
fn metadata_end(file: &mut File, start: u64) -> io::Result<(u64, u64)> {
    let size = file.seek(SeekFrom::End(0))?;
    // After the mark "fLaC" each block has four bytes of its own: whether it is the last, its kind, its length (RFC 9639,
    // section 8.1).
    let mut end = start + 4;
    while end + 4 <= size {
        file.seek(SeekFrom::Start(end))?;
        let mut header = [0; 4];
        file.read_exact(&mut header)?;
        let [kind, high, middle, low] = header;
        end += 4 + u64::from(u32::from_be_bytes([0, high, middle, low]));
        if kind & 0x80 != 0 {
            break;
        }
    }
    file.seek(SeekFrom::Start(start))?;
    Ok((size, end))
}
