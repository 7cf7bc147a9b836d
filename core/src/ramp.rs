//! Gains that are set in steps and heard as ramps.

use crate::number::finite;

/// A gain, linear, that reaches its target in a straight line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ramp {
    value: f32,
    target: f32,
    step: f32,
    /// Samples until it is there.
    left: usize,
}

impl Ramp {
    /// Stands at a gain.
    #[must_use]
    pub fn at(gain: f32) -> Self {
        Self { value: gain, target: gain, ..Self::default() }
    }

    /// Is at a gain after so many samples, one at least.
    pub fn aim(&mut self, target: f32, samples: usize) {
        if target != self.target {
            (self.target, self.left) = (target, samples.max(1));
            self.step = (target - self.value) / self.left as f32;
        }
    }

    /// Whether it stands at silence.
    pub(crate) fn is_zero(&self) -> bool {
        self.left == 0 && self.value == 0.0
    }

    /// The gain of the next sample.
    pub(crate) fn next(&mut self) -> f32 {
        if self.left > 0 {
            self.left -= 1;
            self.value = if self.left == 0 { self.target } else { self.value + self.step };
        }
        self.value
    }

    /// The gains of the next samples.
    pub(crate) fn fill(&mut self, gains: &mut [f32]) {
        let moving = self.left.min(gains.len());
        let (moving, still) = gains.split_at_mut(moving);
        moving.fill_with(|| self.next());
        still.fill(self.value);
    }

    /// Adds samples to a sum by the gains of the next ones; what is no number is silence.
    pub(crate) fn add(&mut self, sound: &[f32], sum: &mut [f32]) {
        let (moving, still) = sound.split_at(self.left.min(sound.len()));
        let (first, rest) = sum.split_at_mut(moving.len().min(sum.len()));
        first.iter_mut().zip(moving).for_each(|(sum, x)| *sum += self.next() * finite(*x));
        let value = self.value;
        rest.iter_mut().zip(still).for_each(|(sum, x)| *sum += value * finite(*x));
    }

    /// Is at its target at once.
    pub(crate) fn jump(&mut self) {
        *self = Self::at(self.target);
    }

    /// Takes samples by the gains of the next ones.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn apply(&mut self, sound: &mut [f32]) {
        for sample in sound {
            if self.left == 0 && self.value == 1.0 {
                return;
            }
            *sample *= self.next();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_goes_there_in_a_straight_line_and_stays() {
        let mut level = Ramp::at(1.0);
        let mut sound = [1.0; 6];
        level.apply(&mut sound);
        assert_eq!(sound, [1.0; 6]);
        level.aim(0.0, 4);
        level.aim(0.0, 4);
        level.apply(&mut sound);
        assert_eq!(sound, [0.75, 0.5, 0.25, 0.0, 0.0, 0.0]);
    }
}
