//! The layout of RWAVS (Liang et al. 2023), as AV-Cloud's preparation leaves it.

use super::import::{ImportCapture, MAX_BYTES, cameras, channels, ears, head, mean, stem};
use super::{Capture, Clip, Split, Track};
use crate::BakeError;
use crate::sources::file;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::{CameraPath, Keyframe, Pose};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The rate that publications use, samples per second.
const RATE_HZ: u32 = 22_050;

/// `transforms_scale_train.json` and `transforms_scale_val.json`; other fields are not read.
#[derive(Deserialize)]
struct Transforms {
    camera_path: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    /// 16 numbers, row by row, in either form.
    camera_to_world: Option<Matrix>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Matrix {
    Flat(Vec<f32>),
    Rows(Vec<Vec<f32>>),
}

/// Imports one scene's folder: `binaural_syn_re.wav`, `source_syn_re.wav`, the frames of `transforms_scale_train.json` and
/// `transforms_scale_val.json`, and their poses in `gs_cameras.json`.
///
/// Frame i, counted from 1, is the second from i - 1 to i, and its pose is that second's middle. Frames without a pose or
/// beyond the sound are left out with a note. Up is that of the first camera, y down, unless the options give another: give
/// what was given to `promenade import`. Where there is no `gs_cameras.json`, the frames' own `camera_to_world` is taken: x
/// right, y up, z backward, in a world with z up.
///
/// # Errors
/// Missing or damaged files, cameras that are no rotations, no frame that is left. Checked against layouts that were made by
/// hand only.
pub fn import_rwavs(folder: &Path, options: &ImportCapture) -> Result<Capture, BakeError> {
    let rate_hz = options.sample_rate_hz.unwrap_or(RATE_HZ);
    let mut notes = Vec::new();
    let mut frames: BTreeMap<usize, Split> = BTreeMap::new();
    let mut own: BTreeMap<usize, Pose> = BTreeMap::new();
    let given = folder.join("gs_cameras.json");
    let has_cameras = given.exists();
    for (name, split) in [("train", Split::Train), ("val", Split::Test)] {
        let path = folder.join(format!("transforms_scale_{name}.json"));
        for frame in file::json::<Transforms>(&path, MAX_BYTES)?.camera_path {
            let number = number(&path, &frame.file_path)?;
            if frames.insert(number, split).is_some() {
                return Err(BakeError::entry(&path, &frame.file_path, "each frame once", "it twice"));
            }
            if let (false, Some(matrix)) = (has_cameras, &frame.camera_to_world) {
                own.insert(number, own_head(&path, &frame.file_path, matrix)?);
            }
        }
    }
    let (mut poses, up) = if has_cameras {
        let mut poses = BTreeMap::new();
        for (name, pose) in cameras(&given)? {
            poses.insert(number(&given, &name)?, pose);
        }
        notes.push("poses are those of gs_cameras.json; scale and up of a reconstruction are not in the data".to_owned());
        (poses, Vec3::NEG_Y)
    } else {
        notes.push("poses are the frames' own: axes of OpenGL, z up".to_owned());
        (own, Vec3::Z)
    };
    options.place(up, &mut poses)?;
    let mut dry = mean(&channels(&folder.join("source_syn_re.wav"), rate_hz)?);
    let [mut left, mut right] = ears(&folder.join("binaural_syn_re.wav"), rate_hz)?;
    let len = dry.len().min(left.len());
    let apart = dry.len().abs_diff(left.len()) as f64 / f64::from(rate_hz);
    if apart > 0.0 {
        notes.push(format!("dry and binaural sound differ in length by {apart:.3} s: the longer one was cut"));
    }
    let clip = rate_hz as usize;
    let (mut clips, mut keyframes, mut without, mut beyond) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (number, split) in frames {
        let name = format!("{number:05}");
        let Some(pose) = poses.get(&number) else {
            without.push(name);
            continue;
        };
        keyframes.push(Keyframe { t_s: number as f64 - 0.5, pose: *pose });
        let start = (number - 1) * clip;
        if start + clip > len {
            beyond.push(name);
        } else {
            clips.push(Clip { name, track: 0, start, len: clip, pose: *pose, split });
        }
    }
    for (what, names) in [("without a pose", without), ("beyond the end of the sound", beyond)] {
        if !names.is_empty() {
            notes.push(format!("{} frames {what} left out: {}", names.len(), names.join(", ")));
        }
    }
    if clips.is_empty() {
        return Err(BakeError::content(folder, "frames with a pose and sound", notes.join("; ")));
    }
    let path = CameraPath::new(keyframes).map_err(|e| BakeError::content(folder, "a path", e.to_string()))?;
    [&mut dry, &mut left, &mut right].into_iter().for_each(|x| x.truncate(len));
    let track = Track { name: "walk".to_owned(), dry, binaural: [left, right], path };
    options.finish(folder, rate_hz, (vec![track], clips), notes, "frames with sound")
}

/// The number of a frame, from 1, from a name such as `frames/00001.png`.
fn number(path: &Path, name: &str) -> Result<usize, BakeError> {
    let stem = stem(name);
    let digits = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
    let wrong = || BakeError::entry(path, name, "a frame's number from 1 to 1000000 at the end of its name", stem);
    digits.parse().ok().filter(|n| (1..=1_000_000).contains(n)).ok_or_else(wrong)
}

/// A pose from a frame's own matrix.
fn own_head(path: &Path, name: &str, matrix: &Matrix) -> Result<Pose, BakeError> {
    let flat = match matrix {
        Matrix::Flat(values) => values.clone(),
        Matrix::Rows(rows) => rows.concat(),
    };
    let pose = (flat.len() == 16).then(|| {
        let column = |c: usize| Vec3::new(flat[c], flat[4 + c], flat[8 + c]);
        // x right, y up, z backward.
        let axes = Mat3::from_cols(column(0), -column(1), -column(2));
        head(column(3), axes)
    });
    pose.flatten().ok_or_else(|| BakeError::entry(path, name, "a rotation and a position in 16 numbers", format!("{flat:?}")))
}
