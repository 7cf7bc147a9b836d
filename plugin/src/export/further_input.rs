//! What comes in on the inputs of further sources.

use crate::listener::ramp;
use crate::listener::snapshot::Snapshot;
use crate::parameter::cast::{index, narrow};
use nice_plug::prelude::Buffer;
use promenade_core::glam::Vec3;
use promenade_core::{Ramp, Voice};
use std::ops::Range;

/// Time in which a step of a level is taken, seconds.
pub(super) const RAMP_S: f64 = 0.001;

/// Levels of the inputs, from block to block. The audio thread owns them.
pub(super) struct FurtherInput<const FURTHER: usize> {
    levels: [Ramp; FURTHER],
    /// Whether the levels have been set since it began.
    began: bool,
}

impl<const FURTHER: usize> Default for FurtherInput<FURTHER> {
    fn default() -> Self {
        Self { levels: std::array::from_fn(|_| Ramp::default()), began: false }
    }
}

impl<const FURTHER: usize> FurtherInput<FURTHER> {
    /// The next levels are taken at once.
    pub(super) fn reset(&mut self) {
        self.began = false;
    }

    /// Brings the inputs of a block of `total` samples to their levels; where the block's values are moved to over the block,
    /// `from` has those that it begins with.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn take(
        &mut self,
        inputs: &mut [Buffer],
        snapshot: &Snapshot<FURTHER>,
        from: Option<&Snapshot<FURTHER>>,
        total: usize,
        sample_rate_hz: f64,
    ) {
        let began = std::mem::replace(&mut self.began, true);
        for (number, ((input, level), to)) in inputs.iter_mut().zip(&mut self.levels).zip(&snapshot.further).enumerate() {
            let gain = to.gain;
            if !began {
                *level = Ramp::at(gain);
            }
            let glides = from.is_some_and(|from| from.further[number].gain != gain);
            level.aim(gain, if glides { total } else { index(narrow(RAMP_S * sample_rate_hz)) });
            if let [sound, ..] = input.as_slice() {
                level.apply(sound);
            }
        }
    }
}

/// What each further source plays in a stretch of a block, nothing where that is silence, and where it is at the end of it, a
/// share of the way through the block; `on_path` says how far its path takes each from the scene's emitter then, metres.
pub(super) fn of_span<'a, const FURTHER: usize>(
    inputs: &'a [Buffer],
    snapshot: &Snapshot<FURTHER>,
    from: Option<&Snapshot<FURTHER>>,
    span: Range<usize>,
    share: f32,
    on_path: impl Fn(usize) -> Vec3,
) -> [Voice<'a>; FURTHER] {
    std::array::from_fn(|number| {
        let channel = inputs.get(number).and_then(|input| input.as_slice_immutable().first());
        let to = &snapshot.further[number];
        let begin = from.map(|from| &from.further[number]);
        let input = channel.and_then(|channel| channel.get(span.clone())).filter(|input| !is_silent(input));
        let offset = begin.map_or(to.offset, |begin| ramp::offset_at(begin, to, share));
        Voice::at(input.unwrap_or_default(), on_path(number) + offset)
    })
}

/// Whether all samples are zero.
fn is_silent(sound: &[f32]) -> bool {
    // The sign does not count.
    sound.iter().fold(0, |bits, sample| bits | sample.to_bits()) << 1 == 0
}

/// Mean square of a block's inputs as if they were one; 0 for what is no number.
pub(super) fn power(main: [&[f32]; 2], further: &[Buffer]) -> f32 {
    let of = |channel: &[f32]| channel.iter().map(|x| x * x).sum::<f32>() / channel.len().max(1) as f32;
    let main = 0.5 * (of(main[0]) + of(main[1]));
    let others = further.iter().filter_map(|input| input.as_slice_immutable().first()).map(|channel| of(channel)).sum::<f32>();
    if (main + others).is_finite() { main + others } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_has_either_sign() {
        assert!(is_silent(&[0.0, -0.0]) && is_silent(&[]) && !is_silent(&[0.0, 1e-30]));
    }
}
