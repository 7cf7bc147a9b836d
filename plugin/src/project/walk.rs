//! A camera path as it is kept in files and in projects.

use crate::library;
use promenade_core::{CameraPath, Keyframe, KeyframeEntry, Playback};
use promenade_fault::Fault;
use promenade_paths::ImportOptions;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

/// Keyframes that copies of a path share: a step that can be undone holds none of its own.
#[derive(Clone, Debug, Default)]
pub struct Keyframes(Arc<[KeyframeEntry]>);

impl Deref for Keyframes {
    type Target = [KeyframeEntry];

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl PartialEq for Keyframes {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

impl Serialize for Keyframes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Keyframes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::deserialize(deserializer).map(|keyframes| Self(keyframes.into()))
    }
}

/// A camera path as the project keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SavedWalk {
    /// Poses in rising order of time; none means there is no path.
    pub keyframes: Keyframes,
    /// Path seconds per second of the transport; negative runs backwards.
    pub speed: f64,
    /// Start over at the end instead of staying there.
    pub looping: bool,
    /// The library slot the path was chosen by, 0 for none.
    pub slot: u32,
    /// Name of the file that it was read from, without folder and ending; empty where there is none.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
}

/// A camera path and how it is run through, ready for the audio thread.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// The path.
    pub path: CameraPath,
    /// Speed and looping.
    pub playback: Playback,
}

impl Default for SavedWalk {
    fn default() -> Self {
        Self { keyframes: Keyframes::default(), speed: 1.0, looping: false, slot: 0, name: String::new() }
    }
}

impl SavedWalk {
    /// Reads a camera path file: JSON, CSV, COLMAP's cameras or a glTF animation. Also returns notes on what had to be assumed.
    ///
    /// # Errors
    /// The file cannot be read or holds no camera path.
    pub fn from_file(path: &Path) -> Result<(Self, Vec<String>), Fault> {
        let name = path.display().to_string();
        let mut beside = |other: &str| library::bytes_of(&path.with_file_name(other));
        let read = library::file::open(path).and_then(|mut file| promenade_paths::bytes_of(&mut file));
        let bytes = read.map_err(Fault::read(path))?;
        let imported = promenade_paths::read(&name, &bytes, &ImportOptions::default(), &mut beside)?;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Ok((Self { name, ..Self::of(imported.path.keyframes()) }, imported.notes))
    }

    /// A path through these keyframes, run through once at its own speed.
    pub fn of(keyframes: &[Keyframe]) -> Self {
        Self { keyframes: Keyframes(keyframes.iter().map(|k| KeyframeEntry::from(*k)).collect()), ..Self::default() }
    }

    /// The path in radians, or `None` when it has no keyframes.
    ///
    /// # Errors
    /// A speed that is not finite, or keyframes that make no path.
    pub fn to_walk(&self) -> Result<Option<Walk>, Fault> {
        if !self.speed.is_finite() {
            return Err(Fault::argument("the camera path's speed", "a finite number", self.speed));
        }
        if self.keyframes.is_empty() {
            return Ok(None);
        }
        let keyframes = self
            .keyframes
            .iter()
            .enumerate()
            .map(|(index, k)| k.to_keyframe(index))
            .collect::<Result<_, _>>()
            .map_err(Fault::of)?;
        let path = CameraPath::new(keyframes).map_err(Fault::of)?;
        Ok(Some(Walk { path, playback: Playback { speed: self.speed, looping: self.looping } }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(json: &str) -> Result<Option<Walk>, Fault> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.json");
        std::fs::write(&path, json).unwrap();
        SavedWalk::from_file(&path)?.0.to_walk()
    }

    #[test]
    fn degrees_become_radians() {
        let json =
            r#"[{"t": 0, "position": [1, 2, 3], "quat": [1, 0, 0, 0]}, {"t": 2, "position": [1, 2, 3], "ypr": [90, 0, 0]}]"#;
        let walk = of(json).unwrap().unwrap();
        let yaw = walk.path.pose_after(2.0, walk.playback).ypr().0;
        assert!((yaw - std::f32::consts::FRAC_PI_2).abs() < 1e-5);
    }

    #[test]
    fn nonsense_is_refused_with_a_reason() {
        for (json, reason) in [
            ("[1", "walk.json"),
            (r#"[{"t": 0, "position": [1, 2, 3]}]"#, "walk.json"),
            (r#"[{"t": 0, "position": [1, 2, 3]}]"#, "ypr"),
            (r#"[{"t": 0, "position": [1, 2, 3], "quat": [0, 0, 0, 0]}]"#, "unit quaternion"),
        ] {
            let error = promenade_fault::with_causes(&of(json).unwrap_err());
            assert!(error.contains(reason), "{error}");
        }
        let error = SavedWalk::from_file(Path::new("no/such.csv")).unwrap_err().to_string();
        assert_eq!(error, "no/such.csv: cannot be read");
        // A file beside that claims more than any walk has: nothing is read of it.
        let folder = tempfile::tempdir().unwrap();
        let gltf = folder.path().join("walk.gltf");
        let document = r#"{
            "asset": {"version": "2.0"}, "cameras": [{"type": "perspective"}], "nodes": [{"camera": 0}],
            "animations": [{
                "samplers": [{"input": 0, "output": 1}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]
            }],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"},
                {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"}
            ],
            "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 24}],
            "buffers": [{"uri": "walk.bin", "byteLength": 32}]
        }"#;
        std::fs::write(&gltf, document).unwrap();
        std::fs::File::create(folder.path().join("walk.bin")).unwrap().set_len(2 << 30).unwrap();
        let error = promenade_fault::with_causes(&SavedWalk::from_file(&gltf).unwrap_err());
        assert!(error.contains("the file has 2147483648 bytes"), "{error}");
        let endless = SavedWalk { speed: f64::INFINITY, ..SavedWalk::default() };
        let error = endless.to_walk().unwrap_err().to_string();
        assert!(error.contains("speed: expected a finite number"), "{error}");
    }
}
