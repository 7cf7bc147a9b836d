//! The late part of responses: rays re-weighted for any surfaces, and noise that has their energy.

mod histories;
mod noise;
mod tie;

pub use histories::{Histories, Surface};
pub(crate) use noise::Noise;
pub(crate) use tie::{BIN_S, LateTie, Slopes};
