//! A camera path as it is kept in files and in projects.

use promenade_core::{CameraPath, KeyframeEntry, PathError, Playback};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A camera path as the project keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct KeptWalk {
    /// Poses in rising order of time; none means there is no path.
    pub keyframes: Vec<KeyframeEntry>,
    /// Path seconds per second of the transport; negative runs backwards.
    pub speed: f64,
    /// Start over at the end instead of staying there.
    pub looping: bool,
    /// The library slot the path was chosen by, 0 for none.
    pub slot: u32,
}

/// A camera path and how it is run through, ready for the audio thread.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// The path.
    pub path: CameraPath,
    /// Speed and looping.
    pub playback: Playback,
}

/// Why a file or a saved state holds no camera path.
#[derive(Debug, Error)]
pub enum WalkError {
    /// The speed is not finite.
    #[error("the camera path's speed is {0}, expected a finite number")]
    Speed(f64),
    /// The keyframes make no path.
    #[error(transparent)]
    Path(#[from] PathError),
    /// The file is no JSON of this form.
    #[error("the camera path cannot be read: {0}")]
    Json(#[from] serde_json::Error),
}

impl Default for KeptWalk {
    fn default() -> Self {
        Self { keyframes: Vec::new(), speed: 1.0, looping: false, slot: 0 }
    }
}

impl KeptWalk {
    /// Reads a camera path file: a JSON array of keyframes.
    ///
    /// # Errors
    /// It is no JSON of this form.
    pub fn from_file(bytes: &[u8], slot: u32) -> Result<Self, WalkError> {
        Ok(Self { keyframes: serde_json::from_slice(bytes)?, slot, ..Self::default() })
    }

    /// The path in radians, or `None` when it has no keyframes.
    ///
    /// # Errors
    /// A speed that is not finite, or keyframes that make no path.
    pub fn to_walk(&self) -> Result<Option<Walk>, WalkError> {
        if !self.speed.is_finite() {
            return Err(WalkError::Speed(self.speed));
        }
        if self.keyframes.is_empty() {
            return Ok(None);
        }
        let keyframes =
            self.keyframes.iter().enumerate().map(|(index, k)| k.to_keyframe(index)).collect::<Result<Vec<_>, _>>()?;
        let path = CameraPath::new(keyframes)?;
        Ok(Some(Walk { path, playback: Playback { speed: self.speed, looping: self.looping } }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(json: &str) -> Result<Option<Walk>, WalkError> {
        KeptWalk::from_file(json.as_bytes(), 1)?.to_walk()
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
        assert!(matches!(of("[1"), Err(WalkError::Json(_))));
        assert!(matches!(
            of(r#"[{"t": 0, "position": [1, 2, 3]}]"#),
            Err(WalkError::Path(PathError::Orientation { index: 0, .. }))
        ));
        assert!(matches!(of(r#"[{"t": 0, "position": [1, 2, 3], "quat": [0, 0, 0, 0]}]"#), Err(WalkError::Path(_))));
        let endless = KeptWalk { speed: f64::INFINITY, ..KeptWalk::default() };
        assert!(matches!(endless.to_walk(), Err(WalkError::Speed(_))));
    }
}
