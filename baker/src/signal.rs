//! Signal processing that several rooms use.

pub(crate) mod convolve;
pub mod random;
pub(crate) mod spectrum;
