//! AV-Cloud: a listener's pose and an anchor cloud go in, masks and time filters come out.
//!
//! Chen and Shlizerman, "AV-Cloud: Spatial Audio Rendering Through Audio-Visual Cloud Splatting", NeurIPS 2024, in the form
//! that its published code trains.

mod alignment;
mod clip;
mod conv;
mod decoder;
mod emitter;
mod hann;
mod kernels;
mod linear;
mod masks;
mod model;
mod pose_decoder;
mod relative;
mod rows;
mod sarh;
mod sarh_clip;
mod tap_head;
mod time_filter;
mod transformer;

pub use alignment::{Alignment, Listener};
pub use clip::ClipRenderer;
pub use conv::{CONV_LAYERS, ConvLayerWeights, ConvWeights};
pub use decoder::CloudDecoder;
pub use emitter::{CloudEmitter, HEAD_RADIUS_M, SPEED_OF_SOUND_M_S};
pub use masks::Masks;
pub use model::{CloudError, CloudKind, CloudModel, CloudParts, CloudSizes, PoseConvention, Tensor};
pub use pose_decoder::{InlineDecoder, PoseDecoder};
pub use sarh::{ConvMode, FrameMasks, SarhError, SarhOptions, SarhStream};
pub use sarh_clip::{ClipSource, SarhClip, SarhGradient, SarhInput};
pub use tap_head::{MAX_LOG_COEFFICIENT, QueryValues, TapHead};
pub use time_filter::{MAX_HARMONICS, Projection, StreamTaps, TapProjector, spherical_harmonics};
