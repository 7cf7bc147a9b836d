//! Signal processing that sources, bakes and measures share.

pub(crate) mod convolve;
pub mod random;
pub(crate) mod spectrum;
