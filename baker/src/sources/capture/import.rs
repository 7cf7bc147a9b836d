//! What importers of data sets share: options, cameras, sounds.

use super::sift::sift;
use super::{Capture, Clip, Track};
use crate::{BakeError, Placement, resample, sound};
use promenade_core::Pose;
use promenade_core::glam::{Mat3, Vec3};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::Path;

/// Bytes that a file of cameras may have.
const MAX_BYTES: u64 = 256 << 20;

/// What a data set does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportCapture {
    /// Name of the place.
    pub title: String,
    /// Whom to credit.
    pub credit: String,
    /// Terms of the data.
    pub licence: String,
    /// Samples per second of the capture; without it what the layout's publications use.
    pub sample_rate_hz: Option<u32>,
    /// Where the sound came from, metres in the capture's world.
    pub emitter: Option<Vec3>,
    /// Direction of up in the data's world; without it as the layout has it.
    pub up: Option<Vec3>,
    /// Metres of one unit of the data, above 0.
    pub metres_per_unit: f32,
    /// Point of the data's world that becomes the origin, its own units.
    pub origin: Vec3,
    /// Length of a clip, seconds, where the layout does not have one.
    pub clip_s: f64,
    /// Share of the clips that are for testing, where the layout does not split them.
    pub test_share: f64,
    /// Seed of that split.
    pub seed: u64,
}

impl Default for ImportCapture {
    fn default() -> Self {
        Self {
            title: String::new(),
            credit: String::new(),
            licence: String::new(),
            sample_rate_hz: None,
            emitter: None,
            up: None,
            metres_per_unit: 1.0,
            origin: Vec3::ZERO,
            clip_s: 1.0,
            test_share: 0.2,
            seed: 1,
        }
    }
}

impl ImportCapture {
    /// A capture of what was read, without clips that nothing can be learnt from.
    pub(super) fn finish(
        &self,
        folder: &Path,
        rate_hz: u32,
        (tracks, clips): (Vec<Track>, Vec<Clip>),
        notes: Vec<String>,
        expected: &str,
    ) -> Result<Capture, BakeError> {
        let mut capture = Capture {
            title: self.title.clone(),
            credit: self.credit.clone(),
            licence: self.licence.clone(),
            sample_rate_hz: f64::from(rate_hz),
            emitter: self.emitter,
            tracks,
            clips,
            notes,
        };
        sift(&mut capture, &[]);
        if capture.clips.is_empty() {
            return Err(BakeError::content(folder, expected, capture.notes.join("; ")));
        }
        Ok(capture)
    }

    pub(super) fn placement(&self, up: Vec3) -> Placement {
        Placement { up: self.up.unwrap_or(up), metres_per_unit: self.metres_per_unit, origin: self.origin }
    }
}

/// A camera in a `cameras.json` or `gs_cameras.json`; other fields are not read.
#[derive(Deserialize)]
struct Camera {
    img_name: String,
    /// Centre in the reconstruction's world.
    position: [f32; 3],
    /// Rows of the rotation from camera axes, x right, y down, z forward, to the world's.
    rotation: [[f32; 3]; 3],
}

/// Heads at the places of cameras, by the names of their images without ending.
pub(super) fn cameras(path: &Path, placement: &Placement) -> Result<BTreeMap<String, Pose>, BakeError> {
    let mut heads = BTreeMap::new();
    for camera in json::<Vec<Camera>>(path)? {
        let rotation = Mat3::from_cols_array_2d(&camera.rotation).transpose();
        let entry = || format!("camera {}", camera.img_name);
        let head = placement.head(Vec3::from_array(camera.position), rotation).ok_or_else(|| {
            BakeError::entry(
                path,
                entry(),
                "a finite position and a rotation",
                format!("{:?} and {:?}", camera.position, camera.rotation),
            )
        })?;
        if heads.insert(stem(&camera.img_name).to_owned(), head).is_some() {
            return Err(BakeError::entry(path, entry(), "each image once", "it twice"));
        }
    }
    Ok(heads)
}

/// A name without its folders and its ending.
pub(super) fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

pub(super) fn json<T: DeserializeOwned>(path: &Path) -> Result<T, BakeError> {
    let size = std::fs::metadata(path).map_err(BakeError::read(path))?.len();
    if size > MAX_BYTES {
        return Err(BakeError::content(path, format!("at most {MAX_BYTES} bytes"), format!("{size}")));
    }
    let text = std::fs::read_to_string(path).map_err(BakeError::read(path))?;
    serde_json::from_str(&text).map_err(|source| BakeError::Json { path: path.to_path_buf(), source })
}

/// A file's channels at another rate.
pub(super) fn channels(path: &Path, rate_hz: u32) -> Result<Vec<Vec<f32>>, BakeError> {
    let sound = sound::read(path)?;
    Ok(resample::signal(&sound.channels, sound.sample_rate_hz, rate_hz)?)
}

/// The mean of a file's channels.
pub(super) fn mono(path: &Path, rate_hz: u32) -> Result<Vec<f32>, BakeError> {
    let all = channels(path, rate_hz)?;
    let count = all.len().max(1) as f32;
    Ok((0..all.first().map_or(0, Vec::len)).map(|i| all.iter().map(|c| c[i]).sum::<f32>() / count).collect())
}

/// The two channels of a file.
pub(super) fn ears(path: &Path, rate_hz: u32) -> Result<[Vec<f32>; 2], BakeError> {
    let all = channels(path, rate_hz)?;
    let count = all.len();
    <[Vec<f32>; 2]>::try_from(all).map_err(|_| BakeError::content(path, "2 channels, left and right", format!("{count}")))
}
