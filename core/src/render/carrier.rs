//! What taps are made of: noise or measured responses.

pub(crate) mod beside_waves;
pub(crate) mod decorrelated;
pub(crate) mod likeness;
pub(crate) mod noise;
pub(crate) mod set;
