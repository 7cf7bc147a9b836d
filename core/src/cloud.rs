//! AV-Cloud: a listener's pose and an anchor cloud go in, masks and time filters come out.
//!
//! Chen and Shlizerman, "AV-Cloud: Spatial Audio Rendering Through Audio-Visual Cloud Splatting", NeurIPS 2024, in the form
//! that its published code trains.

mod masks;
mod model;

pub use masks::Masks;
pub use model::{Alignment, CloudError, CloudKind, CloudModel, CloudParts, CloudSizes, Listener, PoseConvention, Tensor};
