//! The channel that a fit sees of what was recorded.

use super::set::{Clock, Measurement, Place};
use crate::error::FitError;

/// What a fit needs in place of two ears: it models no head, and what a head does to a response is taken for the room's.
pub(super) const NO_HEAD: &str = "a microphone's response, for a fit models no head (or the number of one channel)";

/// A response with all of its channels.
pub(super) struct Recorded {
    pub(super) name: String,
    pub(super) source: Place,
    pub(super) microphone: Place,
    pub(super) clock: Clock,
    pub(super) channels: Vec<Vec<f32>>,
}

impl Recorded {
    /// One channel, counted from 0; of AmbiX the first is sound pressure.
    ///
    /// # Errors
    /// Fewer channels than that.
    pub(super) fn channel(mut self, number: usize) -> Result<Measurement, FitError> {
        if number >= self.channels.len() {
            return Err(crate::error::measurement(
                &self.name,
                format!("at least {} channels", number + 1),
                self.channels.len(),
            ));
        }
        let samples = self.channels.swap_remove(number);
        Ok(Measurement { name: self.name, source: self.source, microphone: self.microphone, clock: self.clock, samples })
    }
}

/// Of unit length; none of nothing.
pub(super) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    (length > 1e-9 && length.is_finite()).then(|| v.map(|c| c / length))
}
