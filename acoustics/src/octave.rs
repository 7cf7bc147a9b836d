//! Octaves, as scenes have them.

pub use promenade_core::octave::{OCTAVES as BANDS, OCTAVES_HZ, Octaves, octave_energy, octave_place};
