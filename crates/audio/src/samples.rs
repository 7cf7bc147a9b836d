//! What a sound file holds, and the rates that it may have.

use crate::FileError;
use std::path::Path;

/// Sample rates that are believed, hertz.
pub const SAMPLE_RATES_HZ: std::ops::RangeInclusive<u32> = 1_000..=1_000_000;

/// A whole sound.
#[derive(Clone, Debug, PartialEq)]
pub struct Sound {
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// Samples of each channel, full scale 1, all of the same length.
    pub channels: Vec<Vec<f32>>,
}

impl Sound {
    /// Samples per channel.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.channels.first().map_or(0, Vec::len)
    }
}

/// Whether the rate of a file is believed.
pub(crate) fn check_rate(path: &Path, sample_rate_hz: u32) -> Result<(), FileError> {
    let (low, high) = (SAMPLE_RATES_HZ.start(), SAMPLE_RATES_HZ.end());
    let wrong = || FileError::content(path, format!("a sample rate of {low} to {high} Hz"), format!("{sample_rate_hz} Hz"));
    SAMPLE_RATES_HZ.contains(&sample_rate_hz).then_some(()).ok_or_else(wrong)
}
