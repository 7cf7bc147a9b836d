//! Pictures: where they draw the eye, and what a renderer may spend on each pixel beside a sound.

mod plane;
mod samples;
mod stands_out;

pub use plane::Plane;
pub use samples::{fused, loudness_of_pixels};
pub use stands_out::picture_saliency;
