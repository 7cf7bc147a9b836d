//! Replay-NVAS as it is published: folders of clips with a sound for each of eight cameras, one of the speakers' own
//! microphones, and boxes of the speakers' faces.
//!
//! The layout is that which the data set's own loader reads (`nvas/datasets/replay_nvas_dataset.py` of "Novel-View Acoustic
//! Synthesis", Chen et al. 2023), as are the high-pass at 150 Hz and the removal of delays.

use super::import::{ImportCapture, MAX_BYTES, channels, ears, head, mean, stem};
use super::{Capture, Clip, Emitter, Split, SplitRule, Track, Voice};
use crate::BakeError;
use crate::signal::convolve::shape;
use crate::sources::file;
use promenade_audio::npy::Array;
use promenade_core::glam::{Mat3, Vec3};
use promenade_core::{CameraPath, Keyframe, Pose};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{signal, spectrum};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Samples per second of publications.
const RATE_HZ: u32 = 16_000;
/// Scenes that publications test on; those to validate with are learnt from here.
const TESTS: [&str; 7] = ["SC-1027", "SC-1044", "SC-1052", "SC-1074", "SC-1084", "SC-1093", "SC-1107"];
/// What is below this, Hz, is taken away, by a Butterworth filter of this order without a change of phase.
const HIGH_PASS_HZ: f64 = 150.0;
const ORDER: i32 = 5;
/// Delays of the sound at a camera against that at the speakers which are believed, seconds: 200 samples at the publications'
/// rate.
const MOST_DELAY_S: f64 = 200.0 / 16_000.0;
/// Width over height of the pictures, and the angle across them that is assumed: the data do not say it.
const ASPECT: f32 = 16.0 / 9.0;
const ACROSS_DEG: f32 = 60.0;
/// Metres of the cameras' unit.
const CENTIMETRE: f64 = 0.01;
/// Bytes that a file of boxes may have.
const MAX_BOXES: u64 = 16 << 20;

/// Where the cameras of each scene are, by their names; numbers are missing where a camera was not found.
#[derive(Deserialize)]
struct Cameras {
    centers: BTreeMap<String, BTreeMap<String, [Option<f32>; 3]>>,
    /// Where they look, of unit length.
    rotations: BTreeMap<String, BTreeMap<String, [Option<f32>; 3]>>,
}

/// The clips by their folders, which end in the scene's name and the clip's number, with the names of their pictures.
type Metadata = BTreeMap<String, Vec<String>>;

/// The two files of a published folder, if it is one: the clips', and the cameras'.
pub(super) fn files(folder: &Path) -> Result<Option<[PathBuf; 2]>, BakeError> {
    let jsons: Vec<PathBuf> = file::entries(folder)?.into_iter().filter(|path| file::ending(path) == "json").collect();
    let is_cameras = |path: &&PathBuf| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("camera_positions"));
    let cameras = jsons.iter().find(is_cameras);
    let clips = jsons.iter().find(|path| path.file_name().is_some_and(|n| n.to_string_lossy().starts_with("metadata")));
    Ok(clips.zip(cameras).map(|(clips, cameras)| [clips.clone(), cameras.clone()]))
}

/// Imports all clips of a published folder.
pub(super) fn import(
    folder: &Path,
    [clips_file, cameras_file]: &[PathBuf; 2],
    options: &ImportCapture,
) -> Result<Capture, BakeError> {
    let rate_hz = options.sample_rate_hz.unwrap_or(RATE_HZ);
    let metadata: Metadata = file::json(clips_file, MAX_BYTES)?;
    let mut heads = cameras(cameras_file)?;
    let metres = options.placement.metres_per_unit.or(Some(CENTIMETRE));
    let placed = ImportCapture {
        placement: promenade_paths::PlacementOptions { metres_per_unit: metres, ..options.placement },
        ..options.clone()
    };
    placed.place(Vec3::Z, &mut heads)?;
    let mut speakers = Speakers::default();
    let (mut tracks, mut clips, mut without) = (Vec::new(), Vec::new(), Vec::new());
    for (key, pictures) in &metadata {
        let [scene, number] = last_two(clips_file, key)?;
        let at = folder.join(&scene).join(&number);
        let near = mean(&channels(&at.join("near.wav"), rate_hz)?);
        let near = high_passed(&near, rate_hz);
        let first = tracks.len();
        let mut seen = Vec::new();
        for picture in pictures {
            let view = stem(picture);
            let name = format!("{scene}-{number}-{view}");
            let Some(pose) = heads.get(&(scene.clone(), format!("DSLR-{view}"))).copied() else {
                without.push(name);
                continue;
            };
            let [left, right] = ears(&at.join(format!("{view}.wav")), rate_hz)?.map(|ear| high_passed(&ear, rate_hz));
            let boxes = at.join(format!("{view}.npy"));
            if boxes.exists() {
                seen.extend(read_boxes(&boxes)?.into_iter().map(|(speaker, at)| (speaker, Ray::through(&pose, at))));
            }
            let len = near.len().min(left.len());
            let [left, right] = [left, right].map(|ear| ear[..len].to_vec());
            let dry = without_delay(&near[..len], [&left, &right], rate_hz);
            let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose }])
                .map_err(|e| BakeError::content(cameras_file, "a finite pose", e.to_string()))?;
            let split = if TESTS.contains(&scene.as_str()) { Split::Test } else { Split::Train };
            clips.push(Clip { name: name.clone(), track: tracks.len(), start: 0, len, pose, split });
            tracks.push(Track { name, voices: vec![Voice { emitter: None, dry }], binaural: [left, right], path });
        }
        speakers.hears(&scene, first..tracks.len(), &seen);
    }
    if clips.iter().all(|clip| clip.split == Split::Train) {
        // None of the published scenes.
        split_by_folder(&mut clips, options);
    }
    let emitters = if options.emitter.is_some() { None } else { speakers.found(&mut tracks) };
    let notes = remarks(&without, emitters.is_some(), options);
    let mut capture = placed.finish(folder, rate_hz, (tracks, clips), notes, "clips with sound")?;
    match emitters {
        Some(emitters) => capture.emitters = emitters,
        None if options.emitter.is_some() => {
            capture.tracks.iter_mut().flat_map(|t| &mut t.voices).for_each(|voice| voice.emitter = Some(0));
        }
        None => {}
    }
    Ok(capture)
}

/// What is said of a capture: clips that were left out, and whether it is known who speaks.
fn remarks(without: &[String], found: bool, options: &ImportCapture) -> Vec<String> {
    let mut notes = vec![
        format!("what is below {HIGH_PASS_HZ} Hz is taken away, and the sound's delay from the speakers to each camera"),
        "each clip is heard by ears that look where its camera does".to_owned(),
    ];
    if !without.is_empty() {
        notes.push(format!("{} clips left out, no camera position: {}", without.len(), without.join(", ")));
    }
    if found {
        notes.push(format!(
            "who speaks is who has most boxes; where they are is where the rays through their boxes meet, of pictures that are \
             taken to be {ACROSS_DEG:.0} degrees wide"
        ));
    } else if options.emitter.is_none() {
        notes.push(
            "who speaks, and where, is not known: boxes of each speaker in pictures of two cameras would tell".to_owned(),
        );
    }
    notes
}

/// Splits clips by the number in their name, as those of one folder are heard from several views.
fn split_by_folder(clips: &mut [Clip], options: &ImportCapture) {
    let folders: Vec<String> = clips.iter().map(|c| c.name.rsplit_once('-').map_or("", |n| n.0).to_owned()).collect();
    let mut different = folders.clone();
    different.dedup();
    let splits = SplitRule::Share { test: options.test_share, seed: options.seed }.splits(different.len());
    for (clip, folder) in clips.iter_mut().zip(&folders) {
        clip.split = different.iter().position(|d| d == folder).map_or(Split::Train, |i| splits[i]);
    }
}

/// Scene and number of a clip's folder.
fn last_two(file: &Path, key: &str) -> Result<[String; 2], BakeError> {
    let mut parts = key.trim_end_matches('/').rsplit('/');
    match (parts.next(), parts.next()) {
        (Some(number), Some(scene)) if ![number, scene].iter().any(|p| p.is_empty() || *p == "..") => {
            Ok([scene.to_owned(), number.to_owned()])
        }
        _ => Err(BakeError::content(file, "folders that end in SCENE/NUMBER", key)),
    }
}

/// Heads that look where cameras do, by scene and name, in the data's own world, z up. The published file has the word NaN for
/// what is not known, which no JSON has.
fn cameras(path: &Path) -> Result<BTreeMap<(String, String), Pose>, BakeError> {
    let text = String::from_utf8(file::bytes(path, MAX_BYTES)?);
    let text = text.map_err(|_| BakeError::content(path, "text", "bytes that are none"))?.replace("NaN", "null");
    let Cameras { centers, rotations } = serde_json::from_str(&text).map_err(BakeError::json(path))?;
    let whole = |numbers: Option<&[Option<f32>; 3]>| Some(Vec3::new(numbers?[0]?, numbers?[1]?, numbers?[2]?));
    let mut heads = BTreeMap::new();
    for (scene, cameras) in &centers {
        for (name, centre) in cameras {
            let looks = whole(rotations.get(scene).and_then(|of| of.get(name))).and_then(Vec3::try_normalize);
            let (Some(centre), Some(ahead)) = (whole(Some(centre)), looks) else { continue };
            let Some(right) = ahead.cross(Vec3::Z).try_normalize() else { continue };
            let axes = Mat3::from_cols(right, ahead.cross(right), ahead);
            heads.extend(head(centre, axes).map(|pose| ((scene.clone(), name.clone()), pose)));
        }
    }
    Ok(heads)
}

fn high_passed(x: &[f32], rate_hz: u32) -> Vec<f32> {
    let gain = |hz: f64| (1.0 / (1.0 + (HIGH_PASS_HZ / hz.max(1e-3)).powi(2 * ORDER))).sqrt();
    let [filtered, _] = shape(x, f64::from(rate_hz), |hz| [Complex32::new(gain(hz) as f32, 0.0); 2]);
    filtered
}

/// The dry sound as late as the ears hear it: the generalised cross-correlation with phase transform (Knapp and Carter 1976)
/// tells by how much.
fn without_delay(near: &[f32], ears: [&[f32]; 2], rate_hz: u32) -> Vec<f32> {
    let length = (2 * near.len()).next_power_of_two();
    let both = ears[0].iter().zip(ears[1]).map(|(l, r)| 0.5 * (l + r));
    let heard = spectrum(both, length);
    let product = heard.iter().zip(spectrum(near.iter().copied(), length)).map(|(a, b)| {
        let cross = a * b.conj();
        if cross.norm() > 0.0 { cross / cross.norm() } else { cross }
    });
    let likeness = signal(product.collect(), length);
    let most = ((MOST_DELAY_S * f64::from(rate_hz)) as usize).min(near.len().saturating_sub(1));
    let at = |lag: isize| likeness[lag.rem_euclid(length as isize) as usize].abs();
    let lag = (-(most as isize)..=most as isize).max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap_or(0);
    let earlier = |i: usize| i.checked_add_signed(-lag).and_then(|i| near.get(i)).copied().unwrap_or(0.0);
    (0..near.len()).map(earlier).collect()
}

/// Speakers by number, each with the middle of its box, as shares of the picture's width and height from its upper left.
fn read_boxes(path: &Path) -> Result<Vec<(i64, [f32; 2])>, BakeError> {
    let wrong = |found: String| BakeError::content(path, "an array of boxes", found);
    let boxes = Array::from_bytes(&file::bytes(path, MAX_BOXES)?).map_err(wrong)?;
    let [_, 5] = boxes.shape[..] else {
        let found = format!("the shape {:?}", boxes.shape);
        return Err(BakeError::content(path, "rows of 5 numbers: corners of a box and its speaker", found));
    };
    let row = |b: &[f64; 5]| (b[4].round() as i64, [b[0] + b[2], b[1] + b[3]].map(|sum| 0.5 * sum as f32));
    Ok(boxes.values.as_chunks().0.iter().filter(|b| b.iter().all(|x| x.is_finite())).map(row).collect())
}

/// A line of sight.
struct Ray {
    from: Vec3,
    /// Of unit length.
    along: Vec3,
}

impl Ray {
    fn through(pose: &Pose, [x, y]: [f32; 2]) -> Self {
        let half = (0.5 * ACROSS_DEG.to_radians()).tan();
        let [right, down] = [(2.0 * x - 1.0) * half, (2.0 * y - 1.0) * half / ASPECT];
        let along = pose.orientation * Vec3::new(1.0, -right, -down);
        Self { from: pose.position, along: along.normalize_or_zero() }
    }
}

/// Who speaks in which tracks, and what is seen of them.
#[derive(Default)]
struct Speakers {
    /// Names by scene and number, in the order in which they are first heard, with the rays to them.
    all: Vec<(String, Vec<Ray>)>,
    /// Of each track the number among them.
    of_tracks: Vec<Option<usize>>,
}

impl Speakers {
    /// The tracks of one clip's folder, and all boxes of its pictures: the speaker with most of them is heard.
    fn hears(&mut self, scene: &str, tracks: std::ops::Range<usize>, seen: &[(i64, Ray)]) {
        let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
        seen.iter().for_each(|(speaker, _)| *counts.entry(*speaker).or_default() += 1);
        let most = counts.iter().max_by_key(|(_, count)| **count).map(|(speaker, _)| *speaker);
        let number = most.map(|speaker| {
            let name = format!("{scene} speaker {speaker}");
            let known = self.all.iter().position(|(n, _)| *n == name).unwrap_or_else(|| {
                self.all.push((name, Vec::new()));
                self.all.len() - 1
            });
            let rays = seen.iter().filter(|(s, _)| *s == speaker).map(|(_, ray)| Ray { ..*ray });
            self.all[known].1.extend(rays);
            known
        });
        self.of_tracks.extend(tracks.map(|_| number));
    }

    /// The emitters, if each track's speaker is known and each speaker's place; tracks are told theirs.
    fn found(self, tracks: &mut [Track]) -> Option<Vec<Emitter>> {
        let numbers: Vec<usize> = self.of_tracks.into_iter().collect::<Option<_>>()?;
        let emitter = |(name, rays): (String, Vec<Ray>)| Some(Emitter { name, ..Emitter::at(meeting(&rays)?) });
        let emitters: Vec<Emitter> = self.all.into_iter().map(emitter).collect::<Option<_>>()?;
        for (track, number) in tracks.iter_mut().zip(numbers) {
            track.voices.iter_mut().for_each(|voice| voice.emitter = Some(number));
        }
        (!emitters.is_empty()).then_some(emitters)
    }
}

/// The place that is nearest to all rays by least squares, unless they are parallel.
fn meeting(rays: &[Ray]) -> Option<Vec3> {
    let (mut sum, mut at) = (Mat3::ZERO, Vec3::ZERO);
    for Ray { from, along } in rays {
        let across = Mat3::IDENTITY - Mat3::from_cols(*along * along.x, *along * along.y, *along * along.z);
        sum += across;
        at += across * *from;
    }
    let scale = rays.len() as f32;
    ((sum * (1.0 / scale)).determinant() > 1e-4).then(|| sum.inverse() * at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::noise;

    #[test]
    fn sound_is_as_late_as_it_is_heard() {
        let near: Vec<f32> = noise(1, 8000);
        let late = |by: usize| -> Vec<f32> { std::iter::repeat_n(0.0, by).chain(near.iter().copied()).take(8000).collect() };
        let heard = late(37);
        let aligned = without_delay(&near, [&heard, &heard], 16_000);
        assert!(aligned.iter().zip(&heard).all(|(a, b)| (a - b).abs() < 1e-6));
    }

    #[test]
    fn rays_meet_where_they_are_seen_from_two_places() {
        let at = Vec3::new(2.0, 1.0, 1.2);
        let ray = |from: Vec3| Ray { from, along: (at - from).normalize() };
        let found = meeting(&[ray(Vec3::ZERO), ray(Vec3::new(4.0, 0.0, 1.5)), ray(Vec3::new(1.0, 5.0, 1.0))]).unwrap();
        assert!(found.distance(at) < 1e-4, "{found}");
        assert!(meeting(&[ray(Vec3::ZERO), ray(0.5 * at)]).is_none(), "all in one line");
        // What is in the middle of a picture is straight ahead; what is right of it lies to the right, which is y below 0.
        let pose = Pose::from_ypr(Vec3::ZERO, 0.0, 0.0, 0.0);
        assert!(Ray::through(&pose, [0.5, 0.5]).along.distance(Vec3::X) < 1e-6);
        let corner = Ray::through(&pose, [1.0, 0.0]).along;
        assert!(corner.y < -0.4 && corner.z > 0.2, "{corner}");
    }

    #[test]
    fn the_bass_is_taken_away_and_nothing_else() {
        let tone =
            |hz: f32| -> Vec<f32> { (0..16_000).map(|i| (std::f32::consts::TAU * hz * i as f32 / 16_000.0).sin()).collect() };
        let middle = |x: &[f32]| x[4000..12_000].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        assert!((middle(&high_passed(&tone(1000.0), 16_000)) - 1.0).abs() < 0.01);
        assert!((middle(&high_passed(&tone(150.0), 16_000)) - 0.707).abs() < 0.02);
        assert!(middle(&high_passed(&tone(60.0), 16_000)) < 0.02);
    }
}
