//! Captures and evaluation from the command line.

use crate::common::{Place, fails, json, promenade, succeeds};
use promenade_baker::capture::{Capture, Clip, Split, Track, Voice};
use promenade_baker::sound;
use promenade_core::glam::Vec3;
use promenade_core::network::CloudEmitter;
use promenade_core::{CameraPath, Keyframe, Pose};
use promenade_testing::Noise;
use std::path::Path;

fn speech() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/speech.wav").to_str().unwrap().to_owned()
}

#[test]
fn a_capture_is_made_checked_and_evaluated() {
    let place = Place::new();
    let (scene, room, speech) = (place.bake(), place.folder.path().to_str().unwrap(), speech());
    let capture = place.text("capture");
    let mix = ["--clip", "0.5", "--clips", "2", "--test-share", "0.3"];
    let (_, said) = succeeds(&[&["capture", "from-responses", room, "--dry", &speech, "-o", &capture], &mix[..]].concat());
    assert!(said.contains("13 tracks") && said.contains("8 to judge by"), "{said}");
    let (text, _) = succeeds(&["capture", "check", &capture]);
    assert!(text.contains("test room") && text.contains("test left") && text.contains("2.00, 0.00, 0.00 m"), "{text}");
    let json = json(&["capture", "check", &capture, "--json"]);
    assert_eq!((json["splits"][1]["clips"].as_u64(), json["sample_rate_hz"].as_f64()), (Some(8), Some(16_000.0)));
    assert!(json["splits"][0]["left"]["mean_dbfs"].as_f64().unwrap() > -40.0, "{json}");

    let names = ["e.json", "e.md", "plots", "wavs"].map(|n| place.text(n));
    let [json, markdown, plots, wavs] = &names;
    let files = ["--json", json, "--markdown", markdown, "--plots", plots, "--wavs", wavs];
    let (table, _) = succeeds(&[&["eval", &scene, &capture, &capture], &files[..]].concat());
    assert!(table.contains("test room on test room: 8 test clips at 16000 Hz, stream"), "{table}");
    assert!(table.contains("Mean over 2 captures") && table.contains("stereo-energy *"), "{table}");
    let markdown = std::fs::read_to_string(markdown).unwrap();
    assert!(markdown.contains("| method") && markdown.contains("MAG (RWAVS)"), "{markdown}");
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let methods = json["evaluations"][1]["methods"].as_array().unwrap();
    let mag = |i: usize| methods[i]["mean"]["avcloud_mag"].as_f64().unwrap();
    assert_eq!(
        (methods.len(), methods[1]["name"].as_str(), methods[0]["clips"].as_array().unwrap().len()),
        (7, Some("mono-mono"), 8)
    );
    assert!(mag(0) < mag(1), "{} {}", mag(0), mag(1));
    assert_eq!(json["overall"][0]["mean"], methods[0]["mean"]);
    let plot = std::fs::read_to_string(Path::new(plots).join("avcloud_mag.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.ends_with("</svg>\n") && plot.matches("<rect").count() == 1 + 7, "{plot}");
    assert_eq!(std::fs::read_dir(plots).unwrap().count(), 8);
    let written: Vec<_> = std::fs::read_dir(Path::new(wavs).join("01-test_room")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(written.len(), 8 * 8, "seven methods and the recording");
    assert_eq!(sound::read(&written[0]).unwrap().frames(), 8_000);

    let (alone, _) = succeeds(&["eval", &scene, &capture, "--no-baselines", "--fit-level", "--poses", "path"]);
    assert!(alone.contains("level was fitted") && !alone.contains("mono"), "{alone}");
}

#[test]
fn mistakes_are_one_line() {
    let place = Place::new();
    let (scene, capture, speech) = (place.bake(), place.text("capture"), speech());
    let room = place.folder.path().to_str().unwrap();
    succeeds(&["capture", "from-responses", room, "--dry", &speech, "-o", &capture]);
    assert!(
        fails(&["capture", "from-responses", room, "-o", &capture]).contains("dry sound: expected at least one, found none")
    );
    assert!(fails(&["eval", &capture, &scene]).contains("expected a scene first, found a capture"));
    assert!(fails(&["eval", &scene, &capture, "--clips"]).contains("anchor cloud"));
    assert!(fails(&["capture", "check", &scene]).contains("room.promenade"));
    let import = |more: &[&str]| fails(&[&["capture", "import", room, "-o", &place.text("x")], more].concat());
    assert!(import(&["--layout", "rwavs"]).contains("transforms_scale_train.json: cannot be read"));
    assert!(!place.path("x").exists());
    assert_eq!(promenade(&["eval", &scene]).status.code(), Some(2));
    assert_eq!(promenade(&["capture", "import", room, "-o", "x", "--layout", "other"]).status.code(), Some(2));
}

/// Noise from an emitter in the open, at listeners once round, or at one who turns on the spot.
fn open_air(emitter: Vec3, is_moving: bool) -> Capture {
    const RATE: f32 = 48_000.0;
    let sphere = CloudEmitter::with_sphere(emitter, 0.0875);
    let pose = |i: u8| {
        let turn = std::f32::consts::TAU * f32::from(i) / 24.0;
        let place = Vec3::new(1.5 * turn.cos(), turn.sin(), 0.4 * (2.0 * turn).sin());
        Pose::from_ypr(if is_moving { place } else { Vec3::ZERO }, 3.0 * turn, 0.3 * (5.0 * turn).sin(), 0.0)
    };
    let track = |i: u8| {
        let dry: Vec<f32> = Noise::new(i.into()).take(9600).map(|v| 0.3 * v).collect();
        let distance = pose(i).position.distance(emitter);
        let ear = |later_s: f32| {
            let late = ((distance / 343.0 + later_s) * RATE).round() as usize;
            (0..dry.len()).map(|n| n.checked_sub(late).map_or(0.0, |n| dry[n] / distance)).collect()
        };
        let half = 0.5 * sphere.delay_s(&pose(i));
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: pose(i) }]).unwrap();
        Track { name: format!("at {i}"), binaural: [ear(half), ear(-half)], voices: vec![Voice { emitter: None, dry }], path }
    };
    let clip = |i: u8| Clip {
        name: format!("clip {i}"),
        track: i.into(),
        start: 1600,
        len: 8000,
        pose: pose(i),
        split: if i == 0 { Split::Test } else { Split::Train },
    };
    Capture {
        title: "open air".to_owned(),
        sample_rate_hz: RATE.into(),
        tracks: (0..24).map(track).collect(),
        clips: (0..24).map(clip).collect(),
        ..Capture::default()
    }
}

#[test]
fn an_emitter_is_located_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (walk, still, truth) = (path("walk"), path("still"), Vec3::new(2.5, 1.0, 0.8));
    open_air(truth, true).write(walk.as_ref()).unwrap();
    let (text, _) = succeeds(&["capture", "emitter", &walk]);
    assert!(text.contains("emitter") && text.contains("spread") && !text.contains("manifest"), "{text}");
    assert_eq!(Capture::load(walk.as_ref()).unwrap().emitter(), None);
    succeeds(&["capture", "emitter", &walk, "--write"]);
    let written = Capture::load(walk.as_ref()).unwrap().emitter().unwrap();
    assert!(written.distance(truth) < 0.2, "{written}");
    assert!(fails(&["capture", "emitter", &walk, "--write"]).contains("--force replaces it"));
    let json = json(&["capture", "emitter", &walk, "--write", "--force", "--json"]);
    assert_eq!(json["clips"].as_u64(), Some(23));
    assert!(json["manifest"]["off_m"].as_f64().unwrap() < 1e-3, "{json}");

    open_air(truth, false).write(still.as_ref()).unwrap();
    assert!(fails(&["capture", "emitter", &still]).contains("distance cannot be told, found 0.00 m"));
    assert!(fails(&["capture", "emitter", &path("none")]).contains("cannot be read"));
    assert_eq!(promenade(&["capture", "emitter", &walk, "--force"]).status.code(), Some(2));
}
