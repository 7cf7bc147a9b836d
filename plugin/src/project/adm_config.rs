//! How an instance takes part in ADM-OSC.

use serde::{Deserialize, Serialize};

/// What a distance of 1 is at first, metres.
const METRES: f32 = 10.0;
/// The least and greatest of these, metres.
pub const METRE_LIMITS: (f32, f32) = (0.1, 50.0);

/// How an instance takes part in ADM-OSC.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AdmConfig {
    /// The number of its object, from 1; 0 takes no part.
    pub object: u32,
    /// What a normalised distance of 1 is, metres.
    pub metres: f32,
}

impl Default for AdmConfig {
    fn default() -> Self {
        Self { object: 0, metres: METRES }
    }
}

impl AdmConfig {
    /// Metres of a distance of 1, within limits.
    pub(crate) fn scale(self) -> f32 {
        let (least, most) = METRE_LIMITS;
        if self.metres.is_finite() { self.metres.clamp(least, most) } else { METRES }
    }
}
