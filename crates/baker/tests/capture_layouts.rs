//! Importers of data sets, on small layouts that are made here: none of the sets themselves is.

use promenade_baker::capture::{ImportCapture, import_rwavs};
use promenade_baker::wav::{self, Format};
use promenade_baker::{Capture, Split};
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use promenade_testing::Noise;
use std::fmt::Display;
use std::path::{Path, PathBuf};

const RATE: u32 = 8_000;

fn noise(seed: u64, count: usize) -> Vec<f32> {
    Noise::new(seed).take(count).map(|v| 0.3 * v).collect()
}

fn text(path: &Path, content: impl Display) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, content.to_string()).unwrap();
}

fn sound(path: PathBuf, channels: &[&[f32]]) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    wav::write(&path, RATE, channels, Format::Float32).unwrap();
}

fn near(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1e-5, "{a} {b}");
}

/// Six seconds of a walk: a camera that stands level in a world with y down, moves ahead along z by a unit a second and looks
/// along x, to its right, from the fourth second on.
fn rwavs(folder: &Path) -> (Vec<f32>, [Vec<f32>; 2]) {
    let (dry, ears) = (noise(1, 48_000), [noise(2, 48_000), noise(3, 48_000)]);
    sound(folder.join("source_syn_re.wav"), &[&dry, &dry]);
    sound(folder.join("binaural_syn_re.wav"), &[&ears[0], &ears[1]]);
    let frames = |numbers: &[u32]| {
        let list: Vec<String> = numbers.iter().map(|n| format!(r#"{{"file_path":"frames/{n:05}.png","fov":90}}"#)).collect();
        format!(r#"{{"camera_path":[{}],"fps":1}}"#, list.join(","))
    };
    text(&folder.join("transforms_scale_train.json"), frames(&[1, 2, 4, 5, 7]));
    text(&folder.join("transforms_scale_val.json"), frames(&[3, 6]));
    let camera = |n: u32| {
        // Rows; columns are right, down and forward in the world.
        let rotation = if n < 4 { "[[1,0,0],[0,1,0],[0,0,1]]" } else { "[[0,0,1],[0,1,0],[-1,0,0]]" };
        format!(
            r#"{{"id":{n},"img_name":"{n:05}","width":8,"height":8,"position":[0,-1,{n}],"rotation":{rotation},"fy":1,"fx":1}}"#
        )
    };
    let list: Vec<String> = [7, 1, 2, 3, 4, 6].map(camera).into();
    text(&folder.join("gs_cameras.json"), format!("[{}]", list.join(",")));
    (dry, ears)
}

#[test]
fn frames_of_their_own_poses_have_the_emitter_of_position_json() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("7");
    let (dry, ears) = (noise(1, 24_000), [noise(2, 24_000), noise(3, 24_000)]);
    // As recorded, twice as loud in one ear.
    let loud: Vec<f32> = ears[0].iter().map(|x| 2.0 * x).collect();
    sound(folder.join("source_syn.wav"), &[&dry]);
    sound(folder.join("binaural_syn.wav"), &[&loud, &ears[1]]);
    let frames = |numbers: &[u32]| {
        let frame = |n: &u32| {
            format!(r#"{{"file_path":"frames/{n:05}.png","camera_to_world":[1,0,0,{n}, 0,0,-1,2, 0,1,0,3, 0,0,0,1]}}"#)
        };
        format!(r#"{{"camera_path":[{}],"fps":24}}"#, numbers.iter().map(frame).collect::<Vec<_>>().join(","))
    };
    text(&folder.join("transforms_scale_train.json"), frames(&[1, 3]));
    text(&folder.join("transforms_scale_val.json"), frames(&[2]));
    let options = ImportCapture { sample_rate_hz: Some(RATE), ..ImportCapture::default() };
    assert_eq!(import_rwavs(&folder, &options).unwrap().emitter(), None);
    text(&place.path().join("position.json"), r#"{"6":{"source_position":[0,0]},"7":{"source_position":[0.5,-1.5],"x":1}}"#);
    let capture = import_rwavs(&folder, &options).unwrap();
    // The cameras' own height.
    near(capture.emitter().unwrap(), Vec3::new(0.5, -1.5, 3.0));
    let notes = capture.notes.join("\n");
    assert!(notes.contains("the unit of the poses is not in the data") && notes.contains("mean height"), "{notes}");
    let peak = |x: &[f32]| x.iter().fold(0.0_f32, |peak, x| peak.max(x.abs()));
    let [left, right] = &capture.tracks[0].binaural;
    assert!((peak(left) - 1.0).abs() < 1e-6 && (peak(&capture.tracks[0].voices[0].dry) - 1.0).abs() < 1e-6);
    assert!((right[100] / left[100] - ears[1][100] / loud[100]).abs() < 1e-4, "ears keep their ratio");
    let known = ImportCapture { emitter: Some(Vec3::ONE), ..options.clone() };
    assert_eq!(import_rwavs(&folder, &known).unwrap().emitter(), Some(Vec3::ONE));
    let scaled = PlacementOptions { metres_per_unit: Some(2.0), ..PlacementOptions::default() };
    let capture = import_rwavs(&folder, &ImportCapture { placement: scaled, ..options.clone() }).unwrap();
    near(capture.emitter().unwrap(), Vec3::new(1.0, -3.0, 6.0));
    assert!(!capture.notes.join("\n").contains("the unit of the poses"));
    for (json, clue) in [
        (r#"{"6":{"source_position":[0,0]}}"#, "expected a scene of the folder's name, found 6"),
        (r#"{"7":{"source_position":[0]}}"#, "expected a source_position of 2 or 3 numbers, found 1"),
    ] {
        text(&place.path().join("position.json"), json);
        let error = import_rwavs(&folder, &options).unwrap_err().to_string();
        assert!(error.contains("position.json") && error.contains(clue), "{error}");
    }
}

#[test]
fn a_second_a_frame() {
    let folder = tempfile::tempdir().unwrap();
    let (dry, ears) = rwavs(folder.path());
    let options = ImportCapture {
        title: "office".to_owned(),
        sample_rate_hz: Some(RATE),
        placement: PlacementOptions { metres_per_unit: Some(2.0), ..PlacementOptions::default() },
        emitter: Some(Vec3::ONE),
        ..ImportCapture::default()
    };
    let capture = import_rwavs(folder.path(), &options).unwrap();
    let names = |split| capture.split(split).map(|c| c.name.as_str()).collect::<Vec<_>>();
    assert_eq!((names(Split::Train), names(Split::Test)), (vec!["00001", "00002", "00004"], vec!["00003", "00006"]));
    let notes = capture.notes.join("\n");
    assert!(notes.contains("1 frames without a pose left out: 00005"), "{notes}");
    assert!(notes.contains("1 frames beyond the end of the sound left out: 00007"), "{notes}");
    let third = capture.split(Split::Test).next().unwrap();
    assert_eq!((third.start, third.len), (16_000, 8_000));
    assert_eq!(capture.binaural(third), [&ears[0][16_000..24_000], &ears[1][16_000..24_000]]);
    assert_eq!(capture.dry(third, 0), dry[16_000..24_000]);
    // y down is z up; a unit is 2 m. In the turn that takes up to z, the camera's z stays level and x becomes x or its
    // opposite.
    let rotation = Quat::from_rotation_arc(Vec3::Z, Vec3::NEG_Y);
    let placement = Placement { units_per_metre: 0.5, rotation, origin: Vec3::ZERO };
    near(third.pose.position, placement.to_scene(Vec3::new(0.0, -1.0, 3.0)));
    near(third.pose.orientation * Vec3::Z, Vec3::Z);
    let fourth = &capture.clips.iter().find(|c| c.name == "00004").unwrap().pose;
    assert!((fourth.position - third.pose.position).dot(third.pose.orientation * Vec3::X) > 1.99, "it walks ahead");
    near(fourth.orientation * Vec3::X, third.pose.orientation * Vec3::NEG_Y);
    // Halfway between two frames' middles.
    near(
        capture.tracks[0].path.pose_at(capture.middle_s(third) - 0.5).position,
        0.5 * (third.pose.position + capture.clips[1].pose.position),
    );
    let written = tempfile::tempdir().unwrap();
    capture.write(written.path()).unwrap();
    assert_eq!(Capture::load(written.path()).unwrap().clips.len(), 5);
}

#[test]
fn frames_may_have_their_own_poses() {
    let folder = tempfile::tempdir().unwrap();
    rwavs(folder.path());
    std::fs::remove_file(folder.path().join("gs_cameras.json")).unwrap();
    let none = import_rwavs(folder.path(), &ImportCapture { sample_rate_hz: Some(RATE), ..ImportCapture::default() });
    assert!(none.unwrap_err().to_string().contains("frames with a pose and sound"));
    // A camera that looks along y: right is x, up is z, backward is -y.
    let flat = "1,0,0,5, 0,0,-1,6, 0,1,0,7, 0,0,0,1";
    let rows = "[1,0,0,5],[0,0,-1,6],[0,1,0,7],[0,0,0,1]";
    let frame = |n: u32, matrix: &str| format!(r#"{{"file_path":"frames/{n:05}.png","camera_to_world":[{matrix}]}}"#);
    let whole = |frames: &[String]| format!(r#"{{"camera_path":[{}]}}"#, frames.join(","));
    text(&folder.path().join("transforms_scale_train.json"), whole(&[frame(1, flat)]));
    text(&folder.path().join("transforms_scale_val.json"), whole(&[frame(2, rows)]));
    let options = ImportCapture { sample_rate_hz: Some(RATE), ..ImportCapture::default() };
    let capture = import_rwavs(folder.path(), &options).unwrap();
    for clip in &capture.clips {
        near(clip.pose.position, Vec3::new(5.0, 6.0, 7.0));
        near(clip.pose.orientation * Vec3::X, Vec3::Y);
        near(clip.pose.orientation * Vec3::Z, Vec3::Z);
    }
    text(&folder.path().join("transforms_scale_val.json"), whole(&[frame(2, "1,0,0,5")]));
    let error = import_rwavs(folder.path(), &options).unwrap_err().to_string();
    assert!(
        error.contains("transforms_scale_val.json") && error.contains("frames/00002.png") && error.contains("16 numbers"),
        "{error}"
    );
    text(&folder.path().join("transforms_scale_val.json"), r#"{"camera_path":[{"file_path":"frames/first.png"}]}"#);
    assert!(import_rwavs(folder.path(), &options).unwrap_err().to_string().contains("a frame's number"));
}
