//! Audio files and sample rates, offline: WAV in and out, FLAC in, files that are whole or not there, conversion between rates.

pub mod atomic;
mod error;
pub mod flac;
pub mod resample;
pub mod sound;
pub mod wav;

pub use error::FileError;
