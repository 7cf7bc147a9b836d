//! What the user changes about the level of an image: early or late, and the room's decay.

use crate::number::single;
use crate::octave::{KILOHERTZ, OCTAVES_HZ};
use crate::render::late::decay_curve::DecayCurve;
use crate::{EARLY_S, Scene, StftGrid, Trim};
use std::sync::Arc;

/// Time over which an image goes from early to late, seconds, about [`EARLY_S`].
const BORDER_S: f64 = 0.005;

/// Levels of images by the time at which they are heard.
pub(crate) struct Levels {
    scene: Arc<Scene>,
    curve: Arc<DecayCurve>,
    rate_hz: f64,
    hop: f64,
    trim: Trim,
}

impl Levels {
    pub(crate) fn new(scene: &Arc<Scene>, curve: &Arc<DecayCurve>, grid: &StftGrid) -> Self {
        let (scene, curve) = (Arc::clone(scene), Arc::clone(curve));
        Self { scene, curve, rate_hz: grid.sample_rate_hz, hop: grid.hop as f64, trim: Trim::NEUTRAL }
    }

    /// Takes what the user changes. Returns whether it has changed.
    pub(crate) fn set(&mut self, trim: &Trim) -> bool {
        let changed = *trim != self.trim;
        self.trim = *trim;
        changed
    }

    /// The next settings are others than before.
    pub(crate) fn forget(&mut self) {
        self.trim.direct = f32::NAN;
    }

    /// Level of an image that is heard some samples after the direct sound.
    pub(crate) fn gain(&self, after: f64) -> f32 {
        let Trim { early, late, .. } = self.trim;
        let border = (after / self.rate_hz - EARLY_S) / BORDER_S + 0.5;
        let level = early + single(border.clamp(0.0, 1.0)) * (late - early);
        level * single(self.decay(KILOHERTZ, after).exp())
    }

    /// What is left to each octave, natural logarithms.
    pub(crate) fn log_gain(&self, octave: usize, after: f64) -> f32 {
        single(self.decay(octave, after) - self.decay(KILOHERTZ, after))
    }

    /// Gain of another decay, natural logarithm.
    fn decay(&self, octave: usize, after: f64) -> f64 {
        let times = f64::from(self.trim.decay);
        if times == 1.0 {
            return 0.0;
        }
        self.curve.log_gain_at(self.scene.bands(), OCTAVES_HZ[octave], after.max(0.0) / self.hop, times)
    }
}
