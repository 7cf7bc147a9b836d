//! Materials of surfaces, and the air between them.

pub(crate) mod admittance;
pub(crate) mod air;
pub(crate) mod catalogue;
pub(crate) mod curve;
pub(crate) mod eyring;
pub(crate) mod material;
pub(crate) mod shares;
#[cfg(feature = "meshes")]
mod table;
pub(crate) mod wildcard;
