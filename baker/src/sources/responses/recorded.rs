//! Measured responses of any number of channels, before it is said what the channels are.

use super::{Response, Responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;

/// A response as a file has it.
pub(crate) struct Recorded {
    pub(crate) listener: Pose,
    /// World metres; without it only the distance may be known.
    pub(crate) source: Option<Vec3>,
    pub(crate) distance_m: Option<f32>,
    pub(crate) channels: Vec<Vec<f32>>,
    /// File or index it came from.
    pub(crate) name: String,
}

/// What is said of all responses of a file or a manifest.
pub(crate) struct About {
    pub(crate) title: String,
    pub(crate) credit: String,
    pub(crate) licence: String,
    pub(crate) sample_rate_hz: f64,
}

impl About {
    /// A set of binaural responses.
    pub(super) fn responses(self, responses: Vec<Response>) -> Responses {
        let Self { title, credit, licence, sample_rate_hz } = self;
        Responses { title, credit, licence, sample_rate_hz, responses, ..Responses::default() }
    }
}
