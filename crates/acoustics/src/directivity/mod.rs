//! Directions: lattices of them, and the directivity of sources.

pub(crate) mod lattice;
#[cfg(feature = "meshes")]
pub(crate) mod source;
