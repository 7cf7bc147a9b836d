//! Short-time spectra in memory.

pub(crate) mod block;
pub(crate) mod lanes;
pub(crate) mod ring;
