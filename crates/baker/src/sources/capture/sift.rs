//! Leaving out the clips from which nothing can be learnt.

use super::defects::{is_clipped, is_silent};
use super::{Capture, Clip};
use std::collections::BTreeMap;

/// A clip's middle may lie this far beyond the ends of a path, seconds: a pose a second leaves half a second at either end.
const POSE_REACH_S: f64 = 0.5;

/// Gives every clip its pose and leaves out those that are silent, clipped or without a pose, with a note for each reason.
/// `first_dry` is the first sample of each track at which there is dry sound.
pub(super) fn sift(capture: &mut Capture, first_dry: &[usize]) {
    let mut left_out: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let mut kept = Vec::with_capacity(capture.clips.len());
    for mut clip in std::mem::take(&mut capture.clips) {
        match useless(capture, &clip, first_dry.get(clip.track).copied().unwrap_or(0)) {
            Some(why) => left_out.entry(why).or_default().push(clip.name),
            None => {
                clip.pose = capture.tracks[clip.track].path.pose_at(capture.middle_s(&clip));
                kept.push(clip);
            }
        }
    }
    capture.clips = kept;
    for (why, names) in left_out {
        capture.notes.push(format!("{} clips left out, {why}: {}", names.len(), names.join(", ")));
    }
}

/// Whether something can be learnt from a clip.
pub(super) fn is_useful(capture: &Capture, clip: &Clip) -> bool {
    useless(capture, clip, 0).is_none()
}

/// Why a clip is of no use.
fn useless(capture: &Capture, clip: &Clip, first_dry: usize) -> Option<&'static str> {
    let voices = capture.voices(clip, 0);
    let [left, right] = capture.binaural(clip);
    let middle = capture.middle_s(clip);
    let covered = match capture.tracks[clip.track].path.keyframes() {
        [] => false,
        [_] => true,
        [first, .., last] => (first.t_s - POSE_REACH_S..=last.t_s + POSE_REACH_S).contains(&middle),
    };
    if clip.start < first_dry || voices.is_empty() {
        Some("the dry sound is silent")
    } else if is_silent(left) {
        Some("the left ear is silent")
    } else if is_silent(right) {
        Some("the right ear is silent")
    } else if is_clipped(left) || is_clipped(right) {
        Some("the recording is clipped")
    } else if voices.iter().any(|voice| is_clipped(&voice.dry)) {
        Some("the dry sound is clipped")
    } else if !covered {
        Some("no pose at its time")
    } else {
        None
    }
}
