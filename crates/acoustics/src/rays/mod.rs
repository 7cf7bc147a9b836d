//! Rays and particles: the late field, where sound falls, and measures of energy over time.

pub(crate) mod echogram;
#[cfg(feature = "meshes")]
pub(crate) mod intensity;
#[cfg(feature = "meshes")]
pub(crate) mod late_field;
#[cfg(feature = "meshes")]
mod listeners;
pub(crate) mod measures;
pub(crate) mod particles;
#[cfg(feature = "meshes")]
pub(crate) mod reflections;
pub(crate) mod surface;
