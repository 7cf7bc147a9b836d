//! The low-frequency field.

pub(crate) mod bass_filters;
mod convolver;
pub(crate) mod crossover;
pub(crate) mod low_cut;
pub(crate) mod lowest_bins;
pub(crate) mod wave_field;
