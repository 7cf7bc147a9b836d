//! A capture on disk.

use super::manifest::{ClipEntry, EmitterEntry, Manifest, NAME, TrackEntry};
use super::{Capture, Clip, Emitter, Voice};
use crate::wav::{self, Format};
use crate::{BakeError, FileError, atomic};
use promenade_core::KeyframeEntry;
use promenade_core::glam::Vec3;
use std::collections::HashSet;
use std::path::Path;

pub(super) fn write(capture: &Capture, folder: &Path) -> Result<(), BakeError> {
    let rate = capture.sample_rate_hz;
    let rate_hz = rate as u32;
    if f64::from(rate_hz) != rate {
        return Err(BakeError::argument("sample rate of a capture", "a whole number of hertz", rate));
    }
    std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
    let unnamed = match &capture.emitters[..] {
        [Emitter { name, position, facing_deg: None }] if name.is_empty() => Some(position.to_array()),
        _ => None,
    };
    let named = capture.emitters.iter().filter(|_| unnamed.is_none()).map(|e| EmitterEntry {
        name: e.name.clone(),
        position: e.position.to_array(),
        facing: e.facing_deg,
    });
    let mut tracks = Vec::new();
    let mut taken = HashSet::new();
    for track in &capture.tracks {
        let name = file_name(&track.name, &mut taken);
        let (dry, binaural) = (format!("{name}.dry.wav"), format!("{name}.binaural.wav"));
        let [left, right] = &track.binaural;
        if track.voices.len() != 1 && track.voices.iter().any(|voice| voice.emitter.is_none()) {
            let found = format!("one that is not known in track {}", track.name);
            return Err(BakeError::argument("emitters of a mix", "all to be known", found));
        }
        let voices: Vec<&[f32]> = track.voices.iter().map(|voice| &voice.dry[..]).collect();
        wav::write(&folder.join(&dry), rate_hz, &voices, Format::Float32)?;
        wav::write(&folder.join(&binaural), rate_hz, &[left, right], Format::Float32)?;
        let poses = track.path.keyframes().iter().map(|k| KeyframeEntry::from(*k)).collect();
        let heard = |voice: &Voice| Some(capture.emitters.get(voice.emitter?)?.name.clone());
        let emitters: Vec<String> =
            if unnamed.is_some() { Vec::new() } else { track.voices.iter().filter_map(heard).collect() };
        let entry = TrackEntry { name: track.name.clone(), emitters, dry, binaural, ..TrackEntry::default() };
        tracks.push(TrackEntry { poses: Some(poses), ..entry });
    }
    let clip = |c: &Clip| ClipEntry {
        name: c.name.clone(),
        track: capture.tracks[c.track].name.clone(),
        start: c.start,
        len: c.len,
        split: c.split,
    };
    let manifest = Manifest {
        title: capture.title.clone(),
        credit: capture.credit.clone(),
        licence: capture.licence.clone(),
        sample_rate_hz: rate_hz,
        emitter: unnamed,
        emitters: named.collect(),
        tracks,
        clips: Some(capture.clips.iter().map(clip).collect()),
        notes: capture.notes.clone(),
        ..Manifest::current()
    };
    let path = folder.join(NAME);
    let json = serde_json::to_vec(&manifest).map_err(BakeError::json(&path))?;
    atomic::write(&path, &json)
}

/// Puts the emitter into a manifest.
pub(super) fn write_emitter(path: &Path, emitter: Vec3, replace: bool) -> Result<(), BakeError> {
    let mut manifest = Manifest::read(path)?;
    if let (Some([x, y, z]), false) = (manifest.emitter, replace) {
        return Err(BakeError::content(path, "no emitter yet", format!("an emitter at {x}, {y}, {z} m")));
    }
    if !manifest.emitters.is_empty() {
        let names: Vec<&str> = manifest.emitters.iter().map(|e| e.name.as_str()).collect();
        return Err(BakeError::content(path, "no emitters by name", names.join(", ")));
    }
    manifest.emitter = Some(emitter.to_array());
    let json = serde_json::to_string_pretty(&manifest).map_err(BakeError::json(path))?;
    atomic::replace(path, (json + "\n").as_bytes())
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

    #[test]
    fn a_manifest_keeps_all_but_its_emitter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let text = |emitter: &str| {
            let tracks = r#"[{"name": "\"emitter\": [", "dry": "a.wav", "binaural": "b.wav", "path": "c.csv"}]"#;
            format!(r#"{{"version": 1, "title": "emitter"{emitter}, "sample_rate_hz": 16000, "tracks": {tracks}}}"#)
        };
        let emitter = Vec3::new(1.5, -2.25, 0.1);
        let written = |text: &str, replace| {
            std::fs::write(&path, text).unwrap();
            write_emitter(&path, emitter, replace)
        };
        let read = || serde_json::from_slice::<serde_json::Value>(&std::fs::read(&path).unwrap()).unwrap();
        for (before, replace) in [("", false), (r#", "emitter": null"#, false), (r#", "emitter": [0, 0, 1]"#, true)] {
            written(&text(before), replace).unwrap();
            let mut found = read();
            let place = found.as_object_mut().unwrap().remove("emitter").unwrap();
            assert_eq!(serde_json::from_value::<[f32; 3]>(place).unwrap(), emitter.to_array());
            let mut expected: serde_json::Value = serde_json::from_str(&text("")).unwrap();
            expected["credit"] = "".into();
            expected["licence"] = "".into();
            assert_eq!(found, expected);
        }
        let known = text(r#", "emitter": [7, -2.25, 0.1]"#);
        assert!(written(&known, false).unwrap_err().to_string().contains("7, -2.25, 0.1"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), known);
    }
}
