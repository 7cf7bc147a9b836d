//! Audio files and sample rates, offline: WAV in and out, FLAC and AIFF in, files that are whole or not there, conversion
//! between rates, NumPy's arrays.
//!
//! ```
//! use promenade_audio::{resample, sound, wav};
//!
//! let file = std::env::temp_dir().join(format!("promenade-audio-{}.wav", std::process::id()));
//! let tone: Vec<f32> = (0..4_410).map(|i| (i as f32 * 0.1).sin() / 2.0).collect();
//! wav::write(&file, 44_100, &[&tone, &tone], wav::Format::Float32)?;
//!
//! // Whatever the ending says: WAV, FLAC or AIFF, a vector of samples for each channel.
//! let read = sound::read(&file)?;
//! assert_eq!((read.sample_rate_hz, read.channels.len()), (44_100, 2));
//! assert_eq!(read.channels[0], tone);
//! let converted = resample::signal(&read.channels, 44_100, 48_000)?;
//! assert_eq!(converted[0].len(), 4_800);
//! # std::fs::remove_file(&file)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

pub mod atomic;
mod error;
pub mod file;
mod flac;
mod layout;
pub mod pcm;
pub mod resample;
mod samples;
pub mod sound;
pub mod wav;

pub use error::FileError;

/// A sample in single precision: integers of up to 32 bits lose their last bits.
#[expect(clippy::cast_possible_truncation, reason = "samples are near 1")]
pub(crate) fn narrow(value: f64) -> f32 {
    value as f32
}
