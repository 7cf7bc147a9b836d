//! Samples that are stored one by one, WAV and AIFF, read block by block.

use crate::layout::Layout;
use crate::samples::check_rate;
use crate::{FileError, file};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Reads a WAV (RIFF, RF64 or BW64) or AIFF file of up to 4 GiB block by block: integers of 8 to 32 bits, floats of 32 or 64,
/// any number of channels.
pub struct PcmReader {
    file: BufReader<File>,
    layout: Layout,
    path: PathBuf,
    frames: u32,
    position: u32,
}

impl PcmReader {
    /// Opens a file and checks its header against its size. A WAV file whose writer did not come back to state the size of its
    /// samples holds all that there is.
    ///
    /// # Errors
    /// A file that is missing, no regular file, empty, damaged, cut short, without samples, or 4 GiB or more of them; a rate
    /// outside [`crate::sound::SAMPLE_RATES_HZ`]. The message names the file, what was expected and what was found.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let file = file::open(path).map_err(FileError::read(path))?;
        let size = file.metadata().map_err(FileError::read(path))?.len();
        if size == 0 {
            return Err(FileError::content(path, "a WAV, FLAC or AIFF file", "an empty file"));
        }
        let mut file = BufReader::new(file);
        let layout =
            Layout::read(&mut file, size).map_err(|source| FileError::unreadable(path, "WAV, FLAC or AIFF file", source))?;
        let bytes = layout.samples.end - layout.samples.start;
        if layout.samples.end > size {
            let expected = format!("{bytes} bytes of samples, as its header says");
            return Err(FileError::content(path, expected, format!("a file of {size} bytes, cut short")));
        }
        if bytes > u64::from(u32::MAX) {
            return Err(FileError::content(path, "less than 4 GiB of samples", format!("{bytes} bytes")));
        }
        if layout.channels == 0 {
            return Err(FileError::content(path, "at least one channel", "none"));
        }
        check_rate(path, layout.sample_rate_hz)?;
        let frame = u64::from(layout.channels) * layout.encoding.bytes as u64;
        if !bytes.is_multiple_of(frame) {
            return Err(FileError::content(path, "whole samples of all channels", format!("{bytes} bytes")));
        }
        let frames = u32::try_from(bytes / frame).unwrap_or(0);
        if frames == 0 {
            return Err(FileError::content(path, "at least one sample", "none"));
        }
        file.seek(SeekFrom::Start(layout.samples.start)).map_err(FileError::read(path))?;
        Ok(Self { file, layout, path: path.to_path_buf(), frames, position: 0 })
    }

    /// Number of channels, at least 1.
    #[must_use]
    pub fn channels(&self) -> u16 {
        self.layout.channels
    }

    /// Samples per second.
    #[must_use]
    pub fn sample_rate_hz(&self) -> u32 {
        self.layout.sample_rate_hz
    }

    /// Samples per channel in the whole file.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Appends up to `frames` samples to each of `channels`; returns how many, 0 at the end.
    ///
    /// # Errors
    /// A file that ends early or a sample that is not finite.
    ///
    /// # Panics
    /// When `channels` has another length than [`PcmReader::channels`].
    pub fn read(&mut self, frames: usize, channels: &mut [Vec<f32>]) -> Result<usize, FileError> {
        assert_eq!(channels.len(), usize::from(self.channels()), "one buffer per channel");
        let count = frames.min((self.frames - self.position) as usize);
        channels.iter_mut().for_each(|c| c.reserve(count));
        let encoding = self.layout.encoding;
        let mut stored = vec![0; channels.len() * encoding.bytes];
        for frame in 0..count {
            let at = u64::from(self.position) + frame as u64;
            self.file.read_exact(&mut stored).map_err(|source| match source.kind() {
                ErrorKind::UnexpectedEof => {
                    let expected = "a sample, as its header says";
                    FileError::entry(&self.path, format!("sample {at}"), expected, "the end of the file")
                }
                _ => FileError::read(&self.path)(source),
            })?;
            for (number, (channel, bytes)) in channels.iter_mut().zip(stored.chunks_exact(encoding.bytes)).enumerate() {
                let value = encoding.value(bytes);
                if !value.is_finite() {
                    let entry = format!("sample {at} of channel {number}");
                    return Err(FileError::entry(&self.path, entry, "a finite number", format!("{value}")));
                }
                channel.push(value);
            }
        }
        self.position += u32::try_from(count).unwrap_or(u32::MAX);
        Ok(count)
    }
}
