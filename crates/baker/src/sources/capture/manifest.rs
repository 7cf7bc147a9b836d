//! The manifest of a capture, as it is on disk.

use super::Split;
use crate::BakeError;
use crate::sources::file;
use promenade_core::KeyframeEntry;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Its name in a capture's folder.
pub(super) const NAME: &str = "capture.json";
/// The version that is read and written.
const VERSION: u32 = 1;
/// Bytes that it may have: a keyframe is about 100.
const MAX_BYTES: u64 = 256 << 20;

#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub(super) version: u32,
    pub(super) title: String,
    #[serde(default)]
    pub(super) credit: String,
    #[serde(default)]
    pub(super) licence: String,
    pub(super) sample_rate_hz: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) emitter: Option<[f32; 3]>,
    /// Emitters with names, instead of one without.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) emitters: Vec<EmitterEntry>,
    pub(super) tracks: Vec<TrackEntry>,
    /// Either these ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) clips: Option<Vec<ClipEntry>>,
    /// ... or a rule.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) cut: Option<CutEntry>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) notes: Vec<String>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EmitterEntry {
    pub(super) name: String,
    pub(super) position: [f32; 3],
    /// Yaw and pitch, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) facing: Option<[f32; 2]>,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrackEntry {
    pub(super) name: String,
    /// Names of the emitters that play, one per channel of the dry sound; left out where there is only one emitter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) emitters: Vec<String>,
    /// Sound files, relative to the manifest.
    pub(super) dry: String,
    pub(super) binaural: String,
    /// A path file, relative to the manifest, or keyframes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) path: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) poses: Option<Vec<KeyframeEntry>>,
    /// Seconds by which the dry sound is later than its file says, against the binaural one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) dry_offset_s: f64,
    /// Seconds by which the poses are later than their times say.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) pose_offset_s: f64,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ClipEntry {
    pub(super) name: String,
    pub(super) track: String,
    /// Samples of the binaural file.
    pub(super) start: usize,
    pub(super) len: usize,
    pub(super) split: Split,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CutEntry {
    pub(super) clip_s: f64,
    /// Every so many clips one is for testing ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) every: Option<usize>,
    /// ... or this share of all, chosen by the seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) test_share: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) seed: Option<u64>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the form that serde calls")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Manifest {
    /// One of the version that is written.
    pub(super) fn current() -> Self {
        Self { version: VERSION, ..Self::default() }
    }

    pub(super) fn read(path: &Path) -> Result<Self, BakeError> {
        /// What every version has, so that another one is called by its name.
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let bytes = file::bytes(path, MAX_BYTES)?;
        let Version { version } = serde_json::from_slice(&bytes).map_err(BakeError::json(path))?;
        if version != VERSION {
            return Err(BakeError::content(path, format!("a capture of version {VERSION}"), format!("version {version}")));
        }
        serde_json::from_slice(&bytes).map_err(BakeError::json(path))
    }
}
