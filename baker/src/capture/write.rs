//! A capture on disk.

use super::manifest::{ClipEntry, Manifest, NAME, SplitEntry, TrackEntry};
use super::{Capture, Clip, Split};
use crate::wav::{self, Format};
use crate::{BakeError, FileError, atomic};
use promenade_core::KeyframeEntry;
use std::collections::HashSet;
use std::path::Path;

pub(super) fn write(capture: &Capture, folder: &Path) -> Result<(), BakeError> {
    let rate = capture.sample_rate_hz;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "what does not fit is refused below")]
    let rate_hz = rate as u32;
    if f64::from(rate_hz) != rate {
        let expected = "a whole number of hertz".to_owned();
        return Err(BakeError::Argument { what: "sample rate of a capture", expected, found: rate.to_string() });
    }
    std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    let mut tracks = Vec::new();
    let mut taken = HashSet::new();
    for track in &capture.tracks {
        let name = file_name(&track.name, &mut taken);
        let (dry, binaural) = (format!("{name}.dry.wav"), format!("{name}.binaural.wav"));
        let [left, right] = &track.binaural;
        wav::write(&folder.join(&dry), rate_hz, &[&track.dry], Format::Float32)?;
        wav::write(&folder.join(&binaural), rate_hz, &[left, right], Format::Float32)?;
        let poses = track.path.keyframes().iter().map(|k| KeyframeEntry::from(*k)).collect();
        tracks.push(TrackEntry {
            name: track.name.clone(),
            dry,
            binaural,
            path: None,
            poses: Some(poses),
            dry_offset_s: 0.0,
            pose_offset_s: 0.0,
        });
    }
    let clip = |c: &Clip| ClipEntry {
        name: c.name.clone(),
        track: capture.tracks[c.track].name.clone(),
        start: c.start,
        len: c.len,
        split: match c.split {
            Split::Train => SplitEntry::Train,
            Split::Test => SplitEntry::Test,
        },
    };
    let manifest = Manifest {
        title: capture.title.clone(),
        credit: capture.credit.clone(),
        licence: capture.licence.clone(),
        sample_rate_hz: rate_hz,
        emitter: capture.emitter.map(|e| e.to_array()),
        tracks,
        clips: Some(capture.clips.iter().map(clip).collect()),
        cut: None,
        notes: capture.notes.clone(),
        ..Manifest::current()
    };
    let path = folder.join(NAME);
    let json = serde_json::to_vec(&manifest).map_err(|source| BakeError::Json { path: path.clone(), source })?;
    atomic::write(&path, &json)?;
    Ok(())
}

/// A track's name as a file's on any system, different from those that are taken.
fn file_name(name: &str, taken: &mut HashSet<String>) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || "-_+.".contains(c) { c } else { '_' };
    let short: String = name.chars().map(plain).take(100).collect();
    let base = short.trim_start_matches('.');
    let mut candidate = if base.is_empty() { "track".to_owned() } else { base.to_owned() };
    let stem = candidate.clone();
    let mut number = 2;
    // Names that differ in case only are one on some systems.
    while !taken.insert(candidate.to_lowercase()) {
        candidate = format!("{stem}-{number}");
        number += 1;
    }
    candidate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_and_different() {
        let mut taken = HashSet::new();
        let names = ["a/b", "../x", "A_B", "", "Größe 1"].map(|n| file_name(n, &mut taken));
        assert_eq!(names, ["a_b", "_x", "A_B-2", "track", "Gr__e_1"]);
    }
}
