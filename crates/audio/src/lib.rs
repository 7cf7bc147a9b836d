//! Audio files and sample rates, offline: WAV in and out, FLAC and AIFF in, files that are whole or not there, conversion
//! between rates, NumPy's arrays.

#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

pub mod atomic;
mod error;
pub mod file;
mod flac;
mod layout;
pub mod npy;
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
