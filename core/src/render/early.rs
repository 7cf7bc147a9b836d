//! Direct sound and early reflections.

pub(crate) mod direct_sound;
pub(crate) mod first_hops;
pub(crate) mod images;
pub(crate) mod phasor;
pub(crate) mod taps;
pub(crate) mod taps_ahead;
