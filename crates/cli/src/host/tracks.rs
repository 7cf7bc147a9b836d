//! The sounds that `promenade host` plays into a plugin's inputs.

use anyhow::{Context, Result};
use promenade_audio::FileError;
use promenade_player::Source;
use std::path::PathBuf;

/// The main sound and the mono ones that follow it, each silent after its end.
pub(super) struct Tracks {
    sounds: Vec<Source>,
    /// A block of each channel of each.
    channels: Vec<Vec<Vec<f32>>>,
}

impl Tracks {
    /// Opens further files at the rate of the main sound.
    pub(super) fn open(main: Source, further: &[PathBuf]) -> Result<Self> {
        let rate_hz = main.sample_rate_hz();
        let mut sounds = vec![main];
        for path in further {
            let sound = Source::open(path, Some(rate_hz)).context("--track")?;
            if sound.channels() != 1 {
                return Err(FileError::content(path, "a mono track", format!("{} channels", sound.channels())))
                    .context("--track");
            }
            sounds.push(sound);
        }
        let channels = sounds.iter().map(|sound| vec![Vec::new(); sound.channels()]).collect();
        Ok(Self { sounds, channels })
    }

    /// Samples of the longest.
    pub(super) fn frames(&self) -> usize {
        self.sounds.iter().map(Source::frames).max().unwrap_or(0)
    }

    /// The next samples of every channel.
    pub(super) fn next(&mut self, count: usize) -> Result<Vec<&[f32]>> {
        for (sound, channels) in self.sounds.iter_mut().zip(&mut self.channels) {
            sound.fill(count, channels)?;
        }
        Ok(self.channels.iter().flatten().map(Vec::as_slice).collect())
    }
}
