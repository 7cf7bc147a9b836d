//! Signal processing that sources, bakes and measures share.

pub(crate) mod convolve;
pub(crate) mod spectrum;
