//! Measures of sound, one definition each: pure functions on slices, computed in double precision.
//!
//! Room measures ([`Binaural`], [`decay_time_s`], [`c50_db`], [`itd_s`], [`ild_db`]) act on impulse responses. Distances between a
//! rendering and its reference act on running sound; papers define MAG and ENV differently, so each convention lives in a module of
//! its own name: [`avcloud`], [`rwavs`]. Never quote such a figure without its convention.
//!
//! None of this is real-time safe: every function allocates.

mod audible;
pub mod avcloud;
mod binaural;
mod decay;
mod envelope;
mod interaural;
mod onset;
pub mod rwavs;
mod spectrum;
mod tail;
mod tone;

pub use audible::{AUDIBLE_FLOOR_DB, AUDIBLE_FRAME_DB, audible_lsd_db};
pub use binaural::{Binaural, BinauralError};
pub use decay::{DecayRange, c50_db, decay_time_s, schroeder_db};
pub use envelope::{envelope, envelope_distance};
pub use interaural::{ild_db, itd_s};
pub use onset::onset;
pub use spectrum::{Grid, LSD_EPS, Window, lsd_db};
pub use tail::tail_modulation_db;
pub use tone::{Cleanliness, tone_cleanliness};

use thiserror::Error;

/// Why a measure has no value for the samples it was given.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MetricError {
    /// No sample differs from zero, so there is no onset and no level.
    #[error("the signal is silent, expected a sample other than zero")]
    Silent,
    /// A sample is NaN or infinite.
    #[error("sample {index} is {found}, expected a finite number")]
    NotFinite {
        /// Zero-based number of the sample.
        index: usize,
        /// Its value.
        found: f64,
    },
    /// The sample rate is no positive number.
    #[error("the sample rate is {found} Hz, expected a finite rate above zero")]
    SampleRate {
        /// The rate given, hertz.
        found: f64,
    },
    /// The signal ends before the measure has what it needs.
    #[error("{measure} needs at least {needed} samples, found {found}")]
    TooShort {
        /// What was to be measured.
        measure: &'static str,
        /// Samples needed.
        needed: usize,
        /// Samples found.
        found: usize,
    },
    /// The decay does not pass through the range to be measured.
    #[error("the decay has {found} samples between {upper_db} and {lower_db} dB, expected at least 2")]
    NoDecay {
        /// Upper end of the range, dB.
        upper_db: f64,
        /// Lower end of the range, dB.
        lower_db: f64,
        /// Samples of the decay inside the range.
        found: usize,
    },
    /// Two signals that belong together have different lengths.
    #[error("the signals have {first} and {second} samples, expected the same length")]
    Lengths {
        /// Samples of the first signal.
        first: usize,
        /// Samples of the second signal.
        second: usize,
    },
    /// A frequency lies outside what the sampled signal can hold or the measure can see.
    #[error("{found} Hz lies outside the measurable range up to {limit} Hz")]
    Frequency {
        /// Frequency asked for, hertz.
        found: f64,
        /// Highest frequency that can be measured, hertz.
        limit: f64,
    },
}

fn check_rate(sample_rate_hz: f64) -> Result<(), MetricError> {
    if sample_rate_hz.is_finite() && sample_rate_hz > 0.0 {
        Ok(())
    } else {
        Err(MetricError::SampleRate { found: sample_rate_hz })
    }
}

fn check_finite(samples: &[f32]) -> Result<(), MetricError> {
    match samples.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(MetricError::NotFinite { index, found: f64::from(samples[index]) }),
    }
}

/// Two signals of one length, all of whose samples are finite.
fn check_pair(first: &[f32], second: &[f32]) -> Result<(), MetricError> {
    if first.len() != second.len() {
        return Err(MetricError::Lengths { first: first.len(), second: second.len() });
    }
    check_finite(first)?;
    check_finite(second)
}

fn energy(samples: &[f32]) -> f64 {
    samples.iter().map(|&v| f64::from(v) * f64::from(v)).sum()
}

/// Seconds as whole samples, rounded down; a negative or absurd time becomes 0 or the largest count.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "float to integer casts saturate, which is what is wanted here"
)]
fn samples_in(seconds: f64, sample_rate_hz: f64) -> usize {
    (seconds * sample_rate_hz) as usize
}

#[cfg(test)]
pub(crate) mod test_signals {
    //! Signals with known measures.

    /// Uniform noise in [-1, 1) by a linear congruential generator, the same on every machine.
    pub(crate) fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(2).wrapping_add(1);
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            })
            .collect()
    }

    /// Exponentially decaying noise that falls by 60 dB in `t60_s`.
    pub(crate) fn decaying_noise(seed: u64, t60_s: f64, seconds: f64, sample_rate_hz: f64) -> Vec<f32> {
        let count = (seconds * sample_rate_hz) as usize;
        let rate = 3.0 * std::f64::consts::LN_10 / (t60_s * sample_rate_hz);
        noise(seed, count).iter().enumerate().map(|(i, v)| (v * (-rate * i as f64).exp()) as f32).collect()
    }

    /// A band-limited pulse around `centre` (samples, fractional): a sinc under a Gaussian, 4 kHz wide at 48 kHz.
    pub(crate) fn pulse(centre: f64, count: usize) -> Vec<f32> {
        (0..count)
            .map(|i| {
                let x = i as f64 - centre;
                let width = 12.0_f64;
                let sinc = if x.abs() < 1e-12 {
                    1.0
                } else {
                    (std::f64::consts::PI * x / 6.0).sin() / (std::f64::consts::PI * x / 6.0)
                };
                (sinc * (-0.5 * (x / width).powi(2)).exp()) as f32
            })
            .collect()
    }
}
