//! Mirror images of sources, in boxes and in meshes.

#[cfg(feature = "meshes")]
mod cone;
pub(crate) mod image;
#[cfg(feature = "meshes")]
pub(crate) mod search;
pub(crate) mod shoebox;
#[cfg(feature = "meshes")]
mod tree;
