//! Scenes and camera paths of the user's library, which an environment variable names: each test runs again in a process that
//! has it.

use promenade_core::KeyframeEntry;
use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Host, Setup, in_both_formats, in_library, render};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

in_both_formats!(slots_choose_files_that_the_project_then_keeps, empty_slots_are_logged_once);

fn field(state: &Value, name: &str) -> Value {
    serde_json::from_str(state["fields"][name].as_str().unwrap()).unwrap()
}

/// Two scenes and a camera path.
fn fill(folder: &Path) {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes");
    for (from, to) in [("iosr-room-a.promenade", "1.promenade"), ("iosr-room-b.promenade", "2.promenade")] {
        fs::copy(scenes.join(from), folder.join(to)).unwrap();
    }
    let path = r#"[{ "t": 0, "position": [0, 0, 0], "ypr": [90, 0, 0] }]"#;
    fs::write(folder.join("turn.json"), path).unwrap();
}

fn slots_choose_files_that_the_project_then_keeps<H: Host>() {
    in_library(fill, slots_in::<H>);
}

fn slots_in<H: Host>(folder: &Path) {
    let signal = noise(12_000);
    let mut expected = H::open(Setup::default());
    expected.set("scene", 0.5);
    expected.set("yaw", 0.75);
    expected.process(&[&[0.0; 64], &[0.0; 64]]);
    expected.reopen(Setup::default());
    let room_b = render(&mut expected, &[&signal, &signal], &[512]);

    let mut host = H::open(Setup::default());
    host.set("scene", 1.0);
    host.set("slot", 2.0 / 64.0);
    host.set("walk", 1.0 / 64.0);
    host.set("follow", 0.5);
    host.process(&[&[0.0; 64], &[0.0; 64]]);
    host.reopen(Setup::default());
    let out = render(&mut host, &[&signal, &signal], &[512]);
    let difference = difference_db(&room_b, &out);
    assert!(difference < -80.0, "the second file and the camera path are not heard: {difference} dB");
    let saved = host.state();
    assert_eq!(field(&saved, "scene")["absolute"], json!(folder.join("2.promenade")));
    let kept: KeyframeEntry = serde_json::from_value(field(&saved, "walk")["keyframes"][0].clone()).unwrap();
    let yaw = kept.to_keyframe(0).unwrap().pose.ypr().0.to_degrees();
    assert!((yaw - 90.0).abs() < 1e-3, "the path's keyframe faces {yaw} degrees to the left");

    // The library changes: what was the second file is the third now, and the path is gone.
    fs::copy(folder.join("1.promenade"), folder.join("0.promenade")).unwrap();
    fs::remove_file(folder.join("turn.json")).unwrap();
    let saved = host.save();
    let mut later = H::open(Setup::default());
    assert!(later.load(&saved));
    later.reopen(Setup::default());
    let out = render(&mut later, &[&signal, &signal], &[512]);
    assert!(difference_db(&room_b, &out) < -80.0, "the project plays another file than it was saved with");

    // The scene of the project is kept beside an empty slot.
    later.set("slot", 1.0);
    later.process(&[&[0.0; 64], &[0.0; 64]]);
    later.reopen(Setup::default());
    assert_eq!(field(&later.state(), "scene")["absolute"], json!(folder.join("2.promenade")));
}

fn empty_slots_are_logged_once<H: Host>() {
    let log = in_library(fill, |_| {
        let mut host = H::open(Setup::default());
        let mut choose = |id, value| {
            host.set(id, value);
            host.instance().settle().unwrap();
        };
        // The path is not followed.
        (10..20).for_each(|slot| choose("walk", f64::from(slot) / 64.0));
        choose("scene", 1.0);
        choose("follow", 0.5);
        for slot in 20..30 {
            choose("slot", f64::from(slot) / 64.0);
            choose("walk", f64::from(slot) / 64.0);
        }
    });
    let Some(log) = log else { return };
    let lines: Vec<&str> = log.lines().filter(|line| line.contains("is empty") || line.contains("neither a slot")).collect();
    assert_eq!(lines.len(), 2, "one of scenes and one of paths: {lines:#?}");
}
