//! A dry sound of one or two channels, read as it is played or held in memory.

use promenade_audio::pcm::PcmReader;
use promenade_audio::sound::{self, Sound};
use promenade_audio::{FileError, resample};
use std::path::{Path, PathBuf};

/// A dry sound of one or two channels.
pub struct Source(Kind);

enum Kind {
    /// Read as it is played.
    File { path: PathBuf, reader: PcmReader },
    /// In memory, with the samples that have been played.
    Held { channels: Vec<Vec<f32>>, rate_hz: u32, played: usize },
}

impl Source {
    /// Opens a WAV or AIFF file, or a FLAC file, which is read whole; converted to a rate where that is given and not the
    /// file's own.
    ///
    /// # Errors
    /// No readable sound file, or one of more than two channels.
    pub fn open(path: &Path, rate_hz: Option<u32>) -> Result<Self, FileError> {
        let few = |channels: usize| {
            let many = || FileError::content(path, "1 or 2 channels", channels.to_string());
            (channels <= 2).then_some(()).ok_or_else(many)
        };
        if !sound::is_flac(path)? {
            let reader = PcmReader::open(path)?;
            few(usize::from(reader.channels()))?;
            if rate_hz.is_none_or(|rate_hz| rate_hz == reader.sample_rate_hz()) {
                return Ok(Self(Kind::File { path: path.to_path_buf(), reader }));
            }
        }
        let Sound { sample_rate_hz, channels } = sound::read(path)?;
        few(channels.len())?;
        match rate_hz.filter(|&rate_hz| rate_hz != sample_rate_hz) {
            None => Ok(Self::held(channels, sample_rate_hz)),
            Some(rate_hz) => Ok(Self::held(resample::signal(&channels, sample_rate_hz, rate_hz)?, rate_hz)),
        }
    }

    /// Channels of one length in memory.
    #[must_use]
    pub fn held(channels: Vec<Vec<f32>>, rate_hz: u32) -> Self {
        Self(Kind::Held { channels, rate_hz, played: 0 })
    }

    /// Samples per second.
    #[must_use]
    pub fn sample_rate_hz(&self) -> u32 {
        match &self.0 {
            Kind::File { reader, .. } => reader.sample_rate_hz(),
            Kind::Held { rate_hz, .. } => *rate_hz,
        }
    }

    /// Number of channels.
    #[must_use]
    pub fn channels(&self) -> usize {
        match &self.0 {
            Kind::File { reader, .. } => usize::from(reader.channels()),
            Kind::Held { channels, .. } => channels.len(),
        }
    }

    /// Samples of each channel.
    #[must_use]
    pub fn frames(&self) -> usize {
        match &self.0 {
            Kind::File { reader, .. } => reader.frames() as usize,
            Kind::Held { channels, .. } => channels.first().map_or(0, Vec::len),
        }
    }

    /// Fills each channel with its next `count` samples, and with silence after the last.
    ///
    /// # Errors
    /// A file that cannot be read on.
    ///
    /// # Panics
    /// When `block` has another number of channels.
    pub fn fill(&mut self, count: usize, block: &mut [Vec<f32>]) -> Result<(), FileError> {
        block.iter_mut().for_each(Vec::clear);
        match &mut self.0 {
            Kind::File { reader, .. } => drop(reader.read(count, block)?),
            Kind::Held { channels, played, .. } => {
                for (to, from) in block.iter_mut().zip(channels.iter()) {
                    to.extend(from.iter().skip(*played).take(count));
                }
                *played += count;
            }
        }
        block.iter_mut().for_each(|channel| channel.resize(count, 0.0));
        Ok(())
    }

    /// All channels from the start.
    ///
    /// # Errors
    /// A file that cannot be read, or is too large to be held in memory.
    pub fn whole(self) -> Result<Vec<Vec<f32>>, FileError> {
        match self.0 {
            Kind::File { path, .. } => Ok(sound::read(&path)?.channels),
            Kind::Held { channels, .. } => Ok(channels),
        }
    }
}

/// The mean of one or two channels.
pub(super) fn mono(channels: &[Vec<f32>]) -> Vec<f32> {
    match channels {
        [] => Vec::new(),
        [first, .., last] => first.iter().zip(last).map(|(a, b)| 0.5 * (a + b)).collect(),
        [one] => one.clone(),
    }
}
