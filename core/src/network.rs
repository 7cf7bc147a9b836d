//! The anchor cloud and its network: a listener goes in, masks come out.
//!
//! Chen and Shlizerman, "AV-Cloud: Spatial Audio Rendering Through Audio-Visual Cloud Splatting", NeurIPS 2024, in the form
//! that its published code trains.

pub(crate) mod decoder;
pub(crate) mod emitter;
pub(crate) mod kernels;
pub(crate) mod linear;
pub(crate) mod masks;
pub(crate) mod model;
pub(crate) mod placement;
pub(crate) mod relative;
pub(crate) mod transformer;

pub use decoder::CloudDecoder;
pub use emitter::{CloudEmitter, HEAD_RADIUS_M, SPEED_OF_SOUND_M_S};
pub use masks::Masks;
pub use model::{CloudError, CloudKind, CloudModel, CloudParts, CloudSizes, PoseConvention, Tensor};
pub use placement::{Alignment, Listener};
