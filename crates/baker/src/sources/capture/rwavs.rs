//! The layout of RWAVS (Liang et al. 2023), as AV-Cloud's preparation leaves it.

use super::import::{ImportCapture, MAX_BYTES, cameras, channels, ears, head, mean, stem};
use super::sift::sift;
use super::{Capture, Clip, Emitter, Split, Track, Voice};
use crate::BakeError;
use crate::sources::file;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::{CameraPath, Keyframe, Pose};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The rate that publications use, samples per second.
const RATE_HZ: u32 = 22_050;

/// `transforms_scale_train.json` and `transforms_scale_val.json`; other fields are not read.
#[derive(Deserialize)]
struct Transforms {
    camera_path: Vec<Frame>,
}

/// `position.json`, beside the scenes' folders, by the folders' names.
#[derive(Deserialize)]
struct Source {
    /// In the world of the frames' own poses; of two numbers the height is not known.
    source_position: Vec<f32>,
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

/// Imports one scene's folder: `binaural_syn_re.wav`, `source_syn_re.wav` (or both without `_re`, as they were recorded: then
/// each is brought to full scale, as the published loaders do), the frames of `transforms_scale_train.json` and
/// `transforms_scale_val.json`, and their poses in `gs_cameras.json`.
///
/// Frame i, counted from 1, is the second from i - 1 to i, and its pose is that second's middle. Frames without a pose or
/// beyond the sound are left out with a note. Up is that of the first camera, y down, unless the options give another: give
/// what was given to `promenade import`. Where there is no `gs_cameras.json`, the frames' own `camera_to_world` is taken: x
/// right, y up, z backward, in a world with z up. That is the world of `position.json`, in the folder or beside it, which says
/// where the sound comes from; the height is the cameras' mean where it has two numbers. The unit is not known.
///
/// # Errors
/// Missing or damaged files, cameras that are no rotations, no frame that is left. Checked against layouts that were made by
/// hand only.
pub fn import_rwavs(folder: &Path, options: &ImportCapture) -> Result<Capture, BakeError> {
    let rate_hz = options.sample_rate_hz.unwrap_or(RATE_HZ);
    let mut notes = Vec::new();
    let given = folder.join("gs_cameras.json");
    let has_cameras = given.exists();
    let (frames, own) = frames(folder, !has_cameras)?;
    let (mut poses, up) = if has_cameras {
        let mut poses = BTreeMap::new();
        for (name, pose) in cameras(&given)? {
            poses.insert(number(&given, &name)?, pose);
        }
        notes.push("poses are those of gs_cameras.json; up of a reconstruction is not in the data".to_owned());
        (poses, Vec3::NEG_Y)
    } else {
        notes.push("poses are the frames' own: axes of OpenGL, z up".to_owned());
        (own, Vec3::Z)
    };
    let level = poses.values().map(|pose| pose.position.z).sum::<f32>() / poses.len().max(1) as f32;
    let placement = options.place(up, &mut poses)?;
    if options.placement.metres_per_unit.is_none() {
        let doubt = "delays and distances are right only if it is; the option metres-per-unit says otherwise";
        notes.push(format!("the unit of the poses is not in the data: one is taken as a metre, and {doubt}"));
    }
    let mut emitter = options.emitter;
    if let (None, Some((path, source))) = (emitter, source(folder)?) {
        if has_cameras {
            notes.push(format!("{} is not read: gs_cameras.json has a world of its own", path.display()));
        } else {
            let place = match source[..] {
                [x, y] => Vec3::new(x, y, level),
                [x, y, z] => Vec3::new(x, y, z),
                _ => return Err(BakeError::content(&path, "a source_position of 2 or 3 numbers", source.len())),
            };
            emitter = Some(placement.to_scene(place));
            let height = if source.len() == 2 { ", at the cameras' mean height" } else { "" };
            notes.push(format!("the emitter is that of {}{height}", path.display()));
        }
    }
    let (dry, [left, right]) = sounds(folder, rate_hz, &mut notes)?;
    let len = dry.len();
    let (clips, keyframes) = clips(frames, &poses, rate_hz as usize, len, &mut notes);
    if clips.is_empty() {
        return Err(BakeError::content(folder, "frames with a pose and sound", notes.join("; ")));
    }
    let path = CameraPath::new(keyframes).map_err(|e| BakeError::content(folder, "a path", e.to_string()))?;
    let voices = vec![Voice { emitter: emitter.map(|_| 0), dry }];
    let mut capture = Capture {
        title: options.title.clone(),
        credit: options.credit.clone(),
        licence: options.licence.clone(),
        sample_rate_hz: f64::from(rate_hz),
        emitters: emitter.map(Emitter::at).into_iter().collect(),
        tracks: vec![Track { name: "walk".to_owned(), voices, binaural: [left, right], path }],
        clips,
        notes,
    };
    sift(&mut capture, &[]);
    if capture.clips.is_empty() {
        return Err(BakeError::content(folder, "frames with sound", capture.notes.join("; ")));
    }
    Ok(capture)
}

/// A clip of `clip` samples for each frame with a pose and sound, and the path of all poses; notes say what is left out.
fn clips(
    frames: BTreeMap<usize, Split>,
    poses: &BTreeMap<usize, Pose>,
    clip: usize,
    len: usize,
    notes: &mut Vec<String>,
) -> (Vec<Clip>, Vec<Keyframe>) {
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
    (clips, keyframes)
}

/// The frames of both splits by their numbers, and their own poses where those are `wanted`.
type Frames = (BTreeMap<usize, Split>, BTreeMap<usize, Pose>);

fn frames(folder: &Path, wanted: bool) -> Result<Frames, BakeError> {
    let (mut frames, mut own) = Frames::default();
    for (name, split) in [("train", Split::Train), ("val", Split::Test)] {
        let path = folder.join(format!("transforms_scale_{name}.json"));
        for frame in file::json::<Transforms>(&path, MAX_BYTES)?.camera_path {
            let number = number(&path, &frame.file_path)?;
            if frames.insert(number, split).is_some() {
                return Err(BakeError::entry(&path, &frame.file_path, "each frame once", "it twice"));
            }
            if let (true, Some(matrix)) = (wanted, &frame.camera_to_world) {
                own.insert(number, own_head(&path, &frame.file_path, matrix)?);
            }
        }
    }
    Ok((frames, own))
}

/// Dry sound and both ears, of one length.
fn sounds(folder: &Path, rate_hz: u32, notes: &mut Vec<String>) -> Result<(Vec<f32>, [Vec<f32>; 2]), BakeError> {
    let (dry_file, dry_raw) = either(folder, "source_syn");
    let (ears_file, ears_raw) = either(folder, "binaural_syn");
    let mut dry = mean(&channels(&dry_file, rate_hz)?);
    let [mut left, mut right] = ears(&ears_file, rate_hz)?;
    if dry_raw {
        to_full_scale(&mut [&mut dry]);
    }
    if ears_raw {
        to_full_scale(&mut [&mut left, &mut right]);
    }
    let len = dry.len().min(left.len());
    let apart = dry.len().abs_diff(left.len()) as f64 / f64::from(rate_hz);
    if apart > 0.0 {
        notes.push(format!("dry and binaural sound differ in length by {apart:.3} s: the longer one was cut"));
    }
    [&mut dry, &mut left, &mut right].into_iter().for_each(|x| x.truncate(len));
    Ok((dry, [left, right]))
}

/// A sound file as the published preparation leaves it or, where that is not there, as it was recorded; whether it is the
/// latter.
fn either(folder: &Path, name: &str) -> (PathBuf, bool) {
    let [prepared, raw] = ["_re.wav", ".wav"].map(|ending| folder.join(format!("{name}{ending}")));
    if !prepared.exists() && raw.exists() { (raw, true) } else { (prepared, false) }
}

fn to_full_scale(channels: &mut [&mut Vec<f32>]) {
    let peak = channels.iter().flat_map(|channel| channel.iter()).fold(0.0_f32, |peak, x| peak.max(x.abs()));
    if peak > 0.0 {
        channels.iter_mut().flat_map(|channel| channel.iter_mut()).for_each(|x| *x /= peak);
    }
}

/// Where the sound of a folder's scene comes from, and the file that says it.
fn source(folder: &Path) -> Result<Option<(PathBuf, Vec<f32>)>, BakeError> {
    let whole = folder.canonicalize().map_err(BakeError::read(folder))?;
    let files = [Some(&*whole), whole.parent()].into_iter().flatten().map(|place| place.join("position.json"));
    let Some(path) = files.into_iter().find(|path| path.exists()) else { return Ok(None) };
    let mut scenes = file::json::<BTreeMap<String, Source>>(&path, MAX_BYTES)?;
    let name = whole.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    match scenes.remove(&name) {
        Some(source) if source.source_position.iter().all(|x| x.is_finite()) => Ok(Some((path, source.source_position))),
        Some(_) => Err(BakeError::entry(&path, name, "finite numbers", "others")),
        None => {
            let known: Vec<String> = scenes.into_keys().collect();
            Err(BakeError::entry(&path, name, "a scene of the folder's name", known.join(", ")))
        }
    }
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
