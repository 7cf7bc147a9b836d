//! Measured responses of any number of channels, before it is said what the channels are.

use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// A response as a file has it.
#[derive(Debug)]
pub struct Recorded {
    /// The head or the microphone.
    pub listener: Pose,
    /// World metres; without it only the distance may be known.
    pub source: Option<Vec3>,
    /// From listener to source, where that alone is known.
    pub distance_m: Option<f32>,
    /// Samples of each channel.
    pub channels: Vec<Vec<f32>>,
    /// File or index it came from.
    pub name: String,
}

/// What is said of all responses of a set.
#[derive(Debug)]
pub struct About {
    /// Name of the set.
    pub title: String,
    /// Who measured it.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second.
    pub sample_rate_hz: f64,
}
