//! What a user changes about a scene's sound: the levels of its parts, its decay, its distance law, its width, its bass.

/// Reflections that come up to this long after the direct sound are early, seconds (ISO 3382-1: the limit of clarity for
/// music).
pub const EARLY_S: f64 = 0.08;

/// The largest gain of a part, linear: +24 dB.
const LOUDEST: f32 = 16.0;
/// Limits of the decay, as a multiple of the scene's.
const DECAYS: (f32, f32) = (0.5, 2.0);
/// The greatest exponent of the distance, and the greatest width.
const STEEPEST: f32 = 2.0;
const WIDEST: f32 = 2.0;
/// Limits of the low cut, Hz; below it is off.
const LOW_CUTS_HZ: (f32, f32) = (10.0, 1_000.0);

/// Steps of a hop towards new values: of gains, width and exponent, and of the decay as a share of it. All time filters follow
/// a decay by turns.
const STEP: f32 = 0.125;
const DECAY_STEP: f32 = 0.015;

/// What a user changes about a scene's sound. By default all of it sounds as the scene has it, to the bit.
///
/// A value that the audio thread takes from the parameters of each block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Gain of the direct sound, linear, 0 to 16.
    pub direct: f32,
    /// Gain of the reflections up to [`EARLY_S`] after the direct sound, linear, 0 to 16.
    pub early: f32,
    /// Gain of what comes after them, linear, 0 to 16.
    pub late: f32,
    /// Reverberation time as a multiple of the scene's, 0.5 to 2.
    pub decay: f32,
    /// Exponent of the distance that the direct sound falls by, 0 to 2: 1 as in the scene, 6 dB each time it doubles; 0 not at
    /// all. Where the scene starts, and in a scene without an emitter, it changes nothing.
    pub distance_law: f32,
    /// Level of the difference between the ears in the room's sound, 0 (both ears hear the same) to 2; the direct sound stays.
    pub width: f32,
    /// Corner of a high-pass of second order before the scene, Hz, at most 1000; below 10 there is none.
    pub low_cut_hz: f32,
}

impl Default for Trim {
    fn default() -> Self {
        Self::NEUTRAL
    }
}

impl Trim {
    /// All as the scene has it.
    pub const NEUTRAL: Self =
        Self { direct: 1.0, early: 1.0, late: 1.0, decay: 1.0, distance_law: 1.0, width: 1.0, low_cut_hz: 0.0 };

    /// Whether only the low cut may differ from [`Trim::NEUTRAL`]: the one thing that a model whose sound is not in parts can
    /// follow.
    #[must_use]
    pub fn leaves_parts(&self) -> bool {
        Self { low_cut_hz: 0.0, ..*self } == Self::NEUTRAL
    }

    /// The nearest values within the limits; neutral ones for what is no number.
    pub(crate) fn bounded(&self) -> Self {
        let within = |value: f32, (least, greatest): (f32, f32), neutral: f32| {
            if value.is_finite() { value.clamp(least, greatest) } else { neutral }
        };
        let low_cut_hz = within(self.low_cut_hz, (0.0, LOW_CUTS_HZ.1), 0.0);
        Self {
            direct: within(self.direct, (0.0, LOUDEST), 1.0),
            early: within(self.early, (0.0, LOUDEST), 1.0),
            late: within(self.late, (0.0, LOUDEST), 1.0),
            decay: within(self.decay, DECAYS, 1.0),
            distance_law: within(self.distance_law, (0.0, STEEPEST), 1.0),
            width: within(self.width, (0.0, WIDEST), 1.0),
            low_cut_hz: if low_cut_hz < LOW_CUTS_HZ.0 { 0.0 } else { low_cut_hz },
        }
    }

    /// Moves by the steps of a hop towards bounded values; the low cut has a glide of its own.
    pub(crate) fn follow(&mut self, wanted: &Self) {
        let step = |from: &mut f32, to: f32, most: f32| *from += (to - *from).clamp(-most, most);
        step(&mut self.direct, wanted.direct, STEP);
        step(&mut self.early, wanted.early, STEP);
        step(&mut self.late, wanted.late, STEP);
        self.decay = wanted.decay.clamp(self.decay * (1.0 - DECAY_STEP), self.decay * (1.0 + DECAY_STEP));
        step(&mut self.distance_law, wanted.distance_law, STEP);
        step(&mut self.width, wanted.width, STEP);
        self.low_cut_hz = wanted.low_cut_hz;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_kept_within_limits_and_reached() {
        let wild =
            Trim { direct: f32::NAN, early: -1.0, late: 1e9, decay: 0.0, distance_law: 9.0, width: -0.1, low_cut_hz: 3.0 };
        let bounded = wild.bounded();
        let want = Trim { direct: 1.0, early: 0.0, late: 16.0, decay: 0.5, distance_law: 2.0, width: 0.0, low_cut_hz: 0.0 };
        assert_eq!(bounded, want);
        assert_eq!(Trim::NEUTRAL.bounded(), Trim::NEUTRAL);
        let mut moving = Trim::NEUTRAL;
        let hops = (0..1_000).take_while(|_| {
            moving.follow(&bounded);
            moving != bounded
        });
        assert_eq!(hops.count(), 119, "the late part has 15 to go");
        (0..1_000).for_each(|_| moving.follow(&Trim::NEUTRAL));
        assert_eq!(moving, Trim::NEUTRAL);
    }
}
