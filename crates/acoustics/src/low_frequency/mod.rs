//! The field of a room at low frequencies, by waves.

pub(crate) mod box_waves;
mod decay;
pub(crate) mod low_field;
pub(crate) mod modes;
#[cfg(feature = "meshes")]
pub(crate) mod waves;
