//! Late reverberation.

pub(crate) mod decay;
pub(crate) mod decay_curve;
pub(crate) mod network;
