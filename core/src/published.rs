//! AV-Cloud's own render head, as its published code has it: time filters and convolution layers on magnitudes, in clips or as a stream.

pub(crate) mod clip;
pub(crate) mod conv;
pub(crate) mod frames;
pub(crate) mod hann;
pub(crate) mod head;
pub(crate) mod stream;
pub(crate) mod tier;
pub(crate) mod time_filter;

pub use clip::ClipRenderer;
pub use conv::{CONV_LAYERS, ConvLayerWeights, ConvWeights};
pub use head::{ClipSource, PublishedClip, PublishedGradient, PublishedInput};
pub use stream::{ConvMode, FrameMasks, PublishedError, PublishedOptions, PublishedStream};
pub use time_filter::{MAX_HARMONICS, Projection, StreamTaps, TapProjector, spherical_harmonics};
