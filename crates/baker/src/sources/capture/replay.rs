//! Multi-view recordings such as Replay-NVAS (Chen et al. 2023): views that stay, and microphones near the sources.

use super::import::{ImportCapture, cameras, channels, ears, mean, stem};
use super::{Capture, Clip, Split, SplitRule, Track, Voice, replay_nvas};
use crate::BakeError;
use crate::sources::file;
use promenade_core::glam::Vec3;
use promenade_core::{CameraPath, Keyframe};
use std::path::{Path, PathBuf};

/// The rate that AV-Cloud uses for Replay-NVAS, samples per second.
const RATE_HZ: u32 = 16_000;

/// Imports a folder as Replay-NVAS is published: a `metadata*.json` that lists the folders of clips and their pictures, a
/// `camera_positions*.json`, and in each `SCENE/NUMBER/` the stereo sound of a camera, `1.wav`, the boxes of speakers in its
/// pictures, `1.npy`, and the sound of the speakers' own microphones, `near.wav`.
///
/// Or one scenario's folder that is arranged by hand: `near/*` the near-range microphones, `views/*` the stereo sound of
/// each view (WAV or FLAC), and `cameras.json` with one camera per view, its `img_name` being the view's name.
///
/// What is assumed of the latter: the near-range microphones are added up to one dry sound, all files begin at the same time,
/// the left and right channels are ears that look where the camera does, and cameras are written as `gs_cameras.json` is
/// (centre in the reconstruction's world, rotation from camera to world, y down). Each view is a track and its listener stands
/// still; clips of all views at one time share their split, so that nothing that is said in a test clip is heard in training.
/// Nothing is filtered; publications take away what is below 150 Hz.
///
/// # Errors
/// Missing or damaged files, a view without a camera, or sounds that are shorter than a clip. Checked against layouts that were
/// made by hand only.
pub fn import_replay(folder: &Path, options: &ImportCapture) -> Result<Capture, BakeError> {
    if let Some(files) = replay_nvas::files(folder)? {
        return replay_nvas::import(folder, &files, options);
    }
    let rate_hz = options.sample_rate_hz.unwrap_or(RATE_HZ);
    let (near, views) = (sounds(&folder.join("near"))?, sounds(&folder.join("views"))?);
    let cameras_path = folder.join("cameras.json");
    let mut heads = cameras(&cameras_path)?;
    options.place(Vec3::NEG_Y, &mut heads)?;
    let mut dry: Vec<f32> = Vec::new();
    for file in &near {
        let one = mean(&channels(file, rate_hz)?);
        dry.resize(dry.len().max(one.len()), 0.0);
        dry.iter_mut().zip(one).for_each(|(sum, v)| *sum += v);
    }
    let clip = ((options.clip_s * f64::from(rate_hz)).round() as usize).max(1);
    let (mut tracks, mut clips) = (Vec::new(), Vec::new());
    for file in &views {
        let shown = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let name = stem(&shown).to_owned();
        let pose = heads.get(&name).ok_or_else(|| {
            let known: Vec<&str> = heads.keys().map(String::as_str).collect();
            BakeError::entry(&cameras_path, format!("view {name}"), "a camera of that img_name", known.join(", "))
        })?;
        let [mut left, mut right] = ears(file, rate_hz)?;
        let len = dry.len().min(left.len());
        left.truncate(len);
        right.truncate(len);
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: *pose }])
            .map_err(|e| BakeError::content(&cameras_path, "a finite pose", e.to_string()))?;
        for number in 0..len / clip {
            let name = format!("{name}-{:05}", number + 1);
            let start = number * clip;
            clips.push(Clip { name, track: tracks.len(), start, len: clip, pose: *pose, split: Split::Train });
        }
        let voices = vec![Voice { emitter: options.emitter.map(|_| 0), dry: dry[..len].to_vec() }];
        tracks.push(Track { name, voices, binaural: [left, right], path });
    }
    let count = clips.iter().map(|c| c.start / clip + 1).max().unwrap_or(0);
    let splits = SplitRule::Share { test: options.test_share, seed: options.seed }.splits(count);
    clips.iter_mut().for_each(|c| c.split = splits[c.start / clip]);
    let notes = vec![
        format!("the dry sound is the sum of {} near-range microphones", near.len()),
        "poses are those of cameras.json; scale and up of a reconstruction are not in the data".to_owned(),
    ];
    options.finish(folder, rate_hz, (tracks, clips), notes, "clips with sound")
}

/// The sound files of a folder, by name.
fn sounds(folder: &Path) -> Result<Vec<PathBuf>, BakeError> {
    let files = file::sounds(folder)?;
    if files.is_empty() {
        return Err(BakeError::content(folder, "files ending in .wav or .flac", "none"));
    }
    Ok(files)
}
