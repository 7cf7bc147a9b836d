//! Measures of sound, and of pictures beside it, one definition each: pure functions on slices, computed in double precision.
//!
//! Room measures ([`decay_time_s`], [`c50_db`], [`itd_s`], [`ild_db`]) act on impulse responses. Distances between a rendering
//! and a recording act on running sound; papers define MAG and ENV differently, so each convention lives in a module of its own
//! name: [`avcloud`], [`rwavs`]. Never quote such a figure without its convention.
//!
//! Samples are `f32` with full scale 1, sample rates are in hertz. None of this is real-time safe: every function allocates.
//!
//! ```
//! use promenade_metrics::{DecayRange, c50_db, decay_time_s, ild_db, itd_s};
//!
//! // Noise that falls by 60 dB in 0.5 s. The right ear hears it 12 samples later and half as loud.
//! let rate_hz = 48_000.0;
//! let mut state = 1_u32;
//! let mut noise = || {
//!     state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
//!     f64::from(state) / f64::from(u32::MAX) - 0.5
//! };
//! let left: Vec<f32> = (0..24_000).map(|i| (noise() * 10_f64.powf(-3.0 * i as f64 / 24_000.0)) as f32).collect();
//! let right: Vec<f32> = [0.0; 12].into_iter().chain(left.iter().map(|sample| sample / 2.0)).collect();
//!
//! let t20_s = decay_time_s(&left, rate_hz, DecayRange::T20)?;
//! assert!((t20_s - 0.5).abs() < 0.025, "{t20_s} s");
//! assert!((c50_db(&left, rate_hz)? - 4.74).abs() < 0.5);
//! assert!((itd_s(&left, &right[..left.len()], rate_hz)? + 12.0 / rate_hz).abs() < 0.1 / rate_hz, "the left ear is earlier");
//! assert!((ild_db(&left, &right)? - 6.02).abs() < 0.01);
//! # Ok::<(), promenade_metrics::MetricError>(())
//! ```

#![forbid(unsafe_code)]

mod arrival;
mod audible;
pub mod avcloud;
mod bands;
mod decay;
mod deconvolution;
mod envelope;
mod interaural;
mod line;
mod localisation;
mod octave;
mod onset;
mod picture;
pub mod rwavs;
mod saliency;
mod spectrogram;
pub mod statistics;
#[cfg(test)]
#[path = "tests/signals.rs"]
mod test_signals;
mod tone;

pub use arrival::{Arrival, arrival};
pub use audible::{AUDIBLE_FLOOR_DB, AUDIBLE_FRAME_DB, audible_lsd_db};
pub use bands::{band_ild_error_db, band_powers};
pub use decay::{DecayRange, backward_integral, c50_db, decay_time_s, schroeder_db};
pub use deconvolution::deconvolve;
pub use envelope::{envelope, envelope_distance};
pub use interaural::{ild_db, interaural_coherence, itd_s, itds_s, running_itd_s};
pub use line::{Line, slope};
pub use localisation::{Cues, lateral_deg, pointed};
pub use octave::{octave_of, smoothed_levels_db};
pub use onset::onset;
pub use picture::{Plane, fused, loudness_of_pixels, picture_saliency};
pub use saliency::{SALIENCY_RATE_HZ, SALIENCY_STEP_S, SampleBudget, picture_weights, saliency};
pub use spectrogram::{LSD_EPS, Spectrogram, Window, lsd_db};
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
    /// A picture of no weight would cost more than the mean of all.
    #[error("the least is {least} samples per pixel, expected at most the mean of {mean}")]
    Budget {
        /// Mean of all pictures, samples per pixel.
        mean: u32,
        /// What a picture of no weight costs, samples per pixel.
        least: u32,
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
fn samples_in(seconds: f64, sample_rate_hz: f64) -> usize {
    (seconds * sample_rate_hz) as usize
}
