//! The late part of responses: rays re-weighted for any surfaces, energy over time, and noise that has it.

mod energies;
mod histories;
mod noise;
mod tie;

pub(crate) use energies::Octave;
pub(crate) use energies::{BIN_S, LOUDSPEAKER_SHARPNESS, ORDER};
pub use histories::{Histories, Surface};
pub(crate) use noise::Noise;
pub(crate) use tie::{LateTie, Slopes};
