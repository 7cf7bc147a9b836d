//! Binaural room responses: where the listener was, where the source was, and what each ear got.
//!
//! [`Responses::load`] reads a SOFA file, or WAV files described by a `responses.json` (see `docs/responses.md`); either way
//! every listener and source ends up in one right-handed world with z up, in metres.

mod check;
mod describe;
mod hold_out;
mod manifest;
mod names;
mod pattern;
pub(crate) mod save;
mod sofa;
mod walls;

pub use describe::{Describe, describe};
pub use hold_out::HoldOut;
pub use promenade_sofa::Side;
pub(crate) use promenade_sofa::{About, Recorded};
pub use walls::Walls;

use crate::BakeError;
use crate::sources::Split;
use crate::sources::file::ending;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One measured or simulated binaural response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The head when it was measured.
    pub listener: Pose,
    /// The source, world metres.
    pub source: Vec3,
    /// Impulse response of the left ear.
    pub left: Vec<f32>,
    /// Impulse response of the right ear, as long as the left.
    pub right: Vec<f32>,
    /// File or index it came from.
    pub name: String,
}

impl Response {
    /// Direction of the source as the head sees it: azimuth in (-180, 180] degrees, positive to the left, and elevation in
    /// [-90, 90] degrees, positive up.
    #[must_use]
    pub fn direction_deg(&self) -> (f32, f32) {
        let v = self.listener.to_head(self.source);
        // The rounding of a rotation must not turn straight ahead or behind into something beside it.
        let tidy = |c: f32| if c.abs() < 1e-6 * v.length() { 0.0 } else { c };
        (tidy(v.y).atan2(tidy(v.x)).to_degrees(), v.z.atan2(v.x.hypot(v.y)).to_degrees())
    }

    /// Metres from the head's centre to the source.
    #[must_use]
    pub fn distance_m(&self) -> f32 {
        self.listener.position.distance(self.source)
    }
}

/// How loud the responses of a set are beside each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Levels {
    /// As they were measured.
    Measured,
    /// Each was normalised by itself; a gain for each brings the late levels of a place back to one.
    Even,
}

/// Responses of one room at one sample rate. Loaded from files or simulated; baked into a scene, written, or made a capture of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Responses {
    /// Name of the set.
    pub title: String,
    /// Who measured it.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second.
    pub sample_rate_hz: f64,
    /// The responses, all of the same length; no two share listener and source.
    pub responses: Vec<Response>,
    /// Notes to the user about the loading, such as repeated measurements that were left out.
    pub notes: Vec<String>,
    /// What the data set has responses for, by their names, where it says so.
    pub splits: BTreeMap<String, Split>,
    /// The room that they were measured in, where it is a box whose lengths are known.
    pub room: Option<Walls>,
    /// How loud they are beside each other; where nothing is known, a bake finds out.
    pub levels: Option<Levels>,
}

/// What a folder of WAV files must have beside them.
const MANIFEST: &str = "a responses.json that describes the WAV files, such as {\"title\": \"Room A\", \"pattern\": \
    \"name_{azimuth}deg.wav\", \"distance_m\": 1.5} (all fields: docs/responses.md; promenade responses manifest writes one \
    from their names)";

/// What the files themselves do not say, or say wrongly.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Folder of the WAV files that a manifest names, instead of the manifest's own.
    pub root: Option<PathBuf>,
    /// The side to which azimuths grow, instead of what the manifest or format says.
    pub azimuth_positive: Option<Side>,
    /// Which emitter of a SOFA file with several, counted from 0; without it only files with one are read.
    pub source: Option<usize>,
}

impl Responses {
    /// A set of binaural responses.
    fn of(about: About, responses: Vec<Response>) -> Self {
        let About { title, credit, licence, sample_rate_hz } = about;
        Self { title, credit, licence, sample_rate_hz, responses, ..Self::default() }
    }

    /// Loads a SOFA file, a manifest (JSON), or a folder with a `responses.json`.
    ///
    /// # Errors
    /// Files that are missing, damaged or disagree in their sample rate; responses with samples that are not finite, with a
    /// silent ear; ears that contradict the directions; more responses than memory should hold. The message names the file.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, BakeError> {
        let manifest = manifest_of(path)?;
        let mut responses = match ending(&manifest).as_str() {
            "json" => manifest::load(&manifest, options)?,
            "sofa" => sofa::load(&manifest, options)?,
            ending => {
                let expected = "a folder with a responses.json, a manifest ending in .json, or a file ending in .sofa";
                return Err(BakeError::content(path, expected, format!("the ending \"{ending}\"")));
            }
        };
        check::finish(&manifest, &mut responses, options.azimuth_positive.is_some())?;
        Ok(responses)
    }
}

/// The file that describes a set: itself, or the manifest of a folder.
fn manifest_of(path: &Path) -> Result<PathBuf, BakeError> {
    let is_folder = std::fs::metadata(path).map_err(BakeError::read(path))?.is_dir();
    let manifest = if is_folder { path.join("responses.json") } else { path.to_path_buf() };
    if is_folder && !manifest.exists() {
        return Err(BakeError::content(path, MANIFEST, "none"));
    }
    Ok(manifest)
}

/// Loads responses of an Ambisonic microphone, their channels as they are, of what [`Responses::load`] takes.
pub(crate) fn ambisonic(path: &Path, options: &LoadOptions) -> Result<(About, Vec<Recorded>), BakeError> {
    let manifest = manifest_of(path)?;
    match ending(&manifest).as_str() {
        "json" => manifest::ambisonic(&manifest, options),
        "sofa" => sofa::ambisonic(&manifest, options),
        ending => {
            let expected = "a folder with a responses.json, a manifest ending in .json, or a file ending in .sofa or .wav";
            Err(BakeError::content(path, expected, format!("the ending \"{ending}\"")))
        }
    }
}
