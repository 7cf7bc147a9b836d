//! An input after its form.

use super::{bytes, flac, hdf5, json, riff, tensors, text};
use fastrand::Rng;

/// What is repeated may be long, and repeated again.
const LONGEST: usize = 1 << 19;

/// An input that differs from one in one to five places that matter in its form; parts of the other may come into it. Lengths
/// and checksums are mended, but not always.
pub(super) fn changed(rng: &mut Rng, input: &[u8], other: &[u8]) -> Vec<u8> {
    let mut result = input.to_vec();
    let damaged = rng.u8(0..8) == 0;
    for _ in 0..[1, 1, 1, 2, 3, 5][rng.usize(..6)] {
        if damaged || !in_its_form(rng, &mut result, other) {
            bytes::change(rng, &mut result, other);
        }
    }
    result.truncate(LONGEST);
    if !damaged {
        flac::mend(&mut result);
        hdf5::mend(input, &mut result);
    }
    result
}

/// Changes an input as one of its form; false where it has none, or none that is whole.
pub(super) fn in_its_form(rng: &mut Rng, input: &mut Vec<u8>, other: &[u8]) -> bool {
    // Some of what holds for any form is not thought of in forms.
    if rng.u8(0..4) == 0 {
        return false;
    }
    let result = if riff::is_one(input) {
        riff::changed(rng, input, other)
    } else if input.starts_with(b"glTF") {
        riff::changed_gltf(rng, input)
    } else if input.get(8) == Some(&b'{') {
        tensors::changed(rng, input)
    } else if let Some(whole) = json::changed(rng, input).filter(|_| rng.u8(0..4) > 0) {
        Some(whole)
    } else {
        text::changed(rng, input)
    };
    result.map(|result| *input = result).is_some()
}
