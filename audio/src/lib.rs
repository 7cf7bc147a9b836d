//! Audio files and sample rates, offline: WAV in and out, files that are whole or not there, conversion between rates.

pub mod atomic;
mod error;
pub mod resample;
pub mod wav;

pub use error::FileError;
