//! The published head: AV-Cloud's Spatial Audio Render Head as its published code has it. Time filters and convolution layers
//! on magnitudes, in clips or as a stream.

pub(crate) mod clip;
pub(crate) mod conv;
pub(crate) mod converted;
pub(crate) mod error;
pub(crate) mod frames;
pub(crate) mod hann;
pub(crate) mod head;
pub(crate) mod renderer;
pub(crate) mod stream;
pub(crate) mod time_filter;

pub use error::PublishedError;
pub use renderer::ClipRenderer;
pub use stream::{ConvMode, FrameMasks, PublishedOptions, PublishedStream};
pub use time_filter::{Projection, StreamTaps, TapProjector, spherical_harmonics};
