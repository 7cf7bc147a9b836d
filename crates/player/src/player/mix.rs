//! How loud the rendered and the dry sound are in what is played.

use std::collections::VecDeque;

/// Linear gains of the rendered and of the dry sound in what is played.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    rendered: f32,
    dry: f32,
}

impl Mix {
    /// The rendered sound alone.
    pub const RENDERED: Self = Self { rendered: 1.0, dry: 0.0 };

    /// A share of rendered sound, 0 to 1, the rest of it dry, and a gain of both, dB.
    #[must_use]
    pub fn new(share: f32, gain_db: f32) -> Self {
        let gain = 10.0_f32.powf(gain_db / 20.0);
        Self { rendered: gain * share, dry: gain * (1.0 - share) }
    }

    /// Leaves the dry sound out; the rendered stays as loud as it was.
    #[must_use]
    pub fn without_dry(self) -> Self {
        Self { dry: 0.0, ..self }
    }

    /// Mixes the dry samples that are waiting into the next samples of both ears.
    pub(super) fn apply(self, ears: [&mut [f32]; 2], waiting: &mut [VecDeque<f32>; 2]) {
        for (ear, waiting) in ears.into_iter().zip(waiting) {
            for x in ear {
                *x = *x * self.rendered + waiting.pop_front().unwrap_or(0.0) * self.dry;
            }
        }
    }
}
