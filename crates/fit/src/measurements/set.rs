//! A set of measured responses: where each was made, and what it is.

use crate::error::FitError;
use promenade_acoustics::Air;
use promenade_audio::resample;

/// A source or a microphone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where it is, metres.
    pub at_m: [f64; 3],
    /// Standard deviation of each coordinate, metres; 0 if it is exact.
    pub sd_m: f64,
    /// Where it faces, of unit length; unknown or without meaning if there is none.
    pub facing: Option<[f64; 3]>,
}

/// What is known of the time at which the source sounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// It sounded at the first sample.
    Known,
    /// Every response has an offset of its own.
    Free,
}

/// One response.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// File or entry that it comes from.
    pub name: String,
    /// Where the sound came from.
    pub source: Place,
    /// Where it was heard.
    pub microphone: Place,
    /// When it began.
    pub clock: Clock,
    /// Sound pressure.
    pub samples: Vec<f32>,
}

/// A set of responses of one rate. Loaded from files once; fits, baselines and judges read it.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements {
    /// Name of the set.
    pub title: String,
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// Responses in the order of their names.
    pub all: Vec<Measurement>,
    /// What is odd about them, for the user.
    pub notes: Vec<String>,
    /// The air that they were made in: the speed of sound, and what is taken on the way.
    pub air: Air,
}

/// What files do not say.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// The rate to convert to, hertz; that of the files without it.
    pub rate_hz: Option<u32>,
    /// Which setting of a set with several, as part of file names: `000` of R3VIVAL.
    pub setting: Option<String>,
    /// Channel of files with several that are neither ears nor AmbiX, counted from 1.
    pub channel: Option<usize>,
    /// The source, where the set does not say where it is, metres.
    pub source_m: Option<[f64; 3]>,
    /// Which of several sources, counted from 0, in layouts that number them.
    pub source_number: Option<usize>,
    /// Standard deviation of places where the set says none, metres.
    pub sd_m: f64,
    /// The air that it was measured in.
    pub air: Air,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            rate_hz: None,
            setting: None,
            channel: None,
            source_m: None,
            source_number: None,
            sd_m: 0.01,
            air: Air::default(),
        }
    }
}

/// Responses that a full fit takes at least.
pub const LEAST_RESPONSES: usize = 3;
/// Samples of all responses of a set together, at most: 1 GiB of `f32`.
pub(super) const MOST_SAMPLES: usize = 1 << 28;

impl Measurements {
    /// Converts all responses to another rate.
    ///
    /// # Errors
    /// A rate of 0.
    pub fn convert(&mut self, rate_hz: u32) -> Result<(), FitError> {
        for one in &mut self.all {
            let samples = std::mem::take(&mut one.samples);
            let mut channels = resample::signal(&[samples], self.sample_rate_hz, rate_hz)?;
            // The resampler keeps amplitudes of signals, so that an impulse becomes as much weaker as its samples become
            // longer.
            let gain = (f64::from(self.sample_rate_hz) / f64::from(rate_hz)) as f32;
            one.samples = channels.swap_remove(0);
            one.samples.iter_mut().for_each(|v| *v *= gain);
        }
        self.sample_rate_hz = rate_hz;
        Ok(())
    }

    /// Some of them, by their numbers.
    #[must_use]
    pub fn only(&self, numbers: &[usize]) -> Self {
        Self {
            title: self.title.clone(),
            sample_rate_hz: self.sample_rate_hz,
            all: numbers.iter().map(|i| self.all[*i].clone()).collect(),
            notes: Vec::new(),
            air: self.air,
        }
    }
}

impl Measurement {
    /// From source to microphone, metres.
    #[must_use]
    pub fn distance_m(&self) -> f64 {
        distance(self.source.at_m, self.microphone.at_m)
    }
}

/// Metres between two places.
pub(crate) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
