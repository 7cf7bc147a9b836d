//! What comes in on the inputs of further sources.

use crate::listener::{ramp, snapshot::Snapshot};
use nice_plug::prelude::Buffer;
use promenade_core::Voice;
use promenade_core::glam::Vec3;
use std::ops::Range;

/// What each further source plays in a stretch of a block, nothing where that is silence, and where it is at the end of it, a
/// share of the way through the block; `on_path` says how far its path takes each from the scene's emitter then, metres. Where
/// the block's values are moved to over the block, `from` has those that it begins with.
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
        let input = channel.and_then(|channel| channel.get(span.clone())).filter(|input| !is_silent(input));
        let at = from.map_or(*to, |from| ramp::place_at(&from.further[number], to, share));
        Voice { level: at.gain, ..Voice::at(input.unwrap_or_default(), on_path(number) + at.offset) }
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
