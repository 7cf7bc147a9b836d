//! Ambisonics, and the head that hears them.

pub(crate) mod ambisonic;
pub(crate) mod bus;
