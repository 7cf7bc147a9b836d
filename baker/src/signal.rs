//! Signal processing that sources, bakes and measures share.

pub(crate) mod convolve;
pub(crate) mod minimum_phase;
pub mod random;
pub(crate) mod spectrum;
