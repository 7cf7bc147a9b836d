//! Scenes and camera paths of the user's library, which an environment variable names: each test runs again in a process that
//! has it.

use promenade_core::KeyframeEntry;
use promenade_tests::listener::{choose, pose_of, put, start_of};
use promenade_tests::signal::{difference_db, noise, rms};
use promenade_tests::{Host, Setup, edit_state, host_id, in_both_formats, in_library, render};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

in_both_formats!(
    slots_choose_files_that_the_project_then_keeps,
    slots_stand_for_the_same_files_when_others_come,
    empty_slots_are_logged_once,
    a_missing_scene_passes_the_dry_sound_at_its_level,
    a_scene_that_the_host_chooses_is_heard_from_where_it_begins,
    scenes_are_as_loud_as_each_other_where_a_project_wants_it,
);

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

/// What automation chose when a project was saved it chooses when the library has grown, and what an older project played.
fn slots_stand_for_the_same_files_when_others_come<H: Host>() {
    let texts = |host: &mut H| [1, 2, 3].map(|slot| host.instance().text(host_id("slot"), f64::from(slot) / 64.0).unwrap());
    let played = |host: &mut H, slot: u32| {
        host.set("scene", 1.0);
        host.set("slot", f64::from(slot) / 64.0);
        host.set("walk", 1.0 / 64.0);
        host.instance().settle().unwrap();
        let state = host.state();
        let file = field(&state, "scene")["absolute"].as_str().unwrap().to_owned();
        (Path::new(&file).file_stem().unwrap().to_str().unwrap().to_owned(), field(&state, "walk")["name"].clone())
    };
    in_library(fill, |folder| {
        let mut host = H::open(Setup::default());
        assert_eq!(played(&mut host, 2), ("2".to_owned(), json!("turn")));
        let (state, own) = (host.save(), host.state());
        fs::copy(folder.join("1.promenade"), folder.join("0.promenade")).unwrap();
        fs::copy(folder.join("turn.json"), folder.join("about.json")).unwrap();
        // Texts are looked up every two seconds.
        std::thread::sleep(std::time::Duration::from_millis(2100));
        let mut later = H::open(Setup::default());
        assert!(later.load(&state));
        assert_eq!(texts(&mut later), ["1", "2", "0"]);
        assert_eq!(["0", "1", "2"], [3, 1, 2].map(|slot| played(&mut later, slot).0));
        assert_eq!(played(&mut later, 2).1, json!("turn"));
        // A state of before slots kept their files has the one that it plays.
        let mut older: Value = own;
        older["fields"].as_object_mut().unwrap().remove("slots");
        let mut older_host = H::open(Setup::default());
        assert!(older_host.load(&serde_json::to_vec(&older).unwrap()));
        assert_eq!(texts(&mut older_host), ["0", "2", "1"]);
        assert_eq!(played(&mut older_host, 2), ("2".to_owned(), json!("turn")));
        assert_eq!(played(&mut older_host, 1).0, "0");
    });
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

/// Level of both ears' mean over a dry sound that falls towards the treble, as music does, dB.
fn level_db<H: Host>(host: &mut H) -> f64 {
    let mut low = 0.0;
    let falling = |x: f32| {
        low += 0.1 * (x - low);
        low
    };
    let signal: Vec<f32> = noise(96_000).into_iter().map(falling).collect();
    let out = render(host, &[&signal, &signal], &[512]);
    20.0 * (rms(&out[0][48_000..]).hypot(rms(&out[1][48_000..])) / rms(&signal)).log10() - 3.01
}

fn scenes_are_as_loud_as_each_other_where_a_project_wants_it<H: Host>() {
    let fill = |folder: &Path| {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        for (from, to) in [("stairwell", "1"), ("concert-hall", "2")] {
            fs::copy(scenes.join(from).with_extension("promenade"), folder.join(to).with_extension("promenade")).unwrap();
        }
    };
    in_library(fill, |folder| {
        let mut host = H::open(Setup::default());
        let levels = |host: &mut H, matching: &Value| {
            [1, 2].map(|slot| {
                let state = host.state();
                assert!(host.load(&edit_state(&state, "matching", matching)));
                host.set("scene", 1.0);
                host.set("slot", f64::from(slot) / 64.0);
                host.instance().settle().unwrap();
                level_db(host)
            })
        };
        let own = levels(&mut host, &json!({}));
        assert!((own[0] - own[1]).abs() > 6.0, "{own:?} dB tell nothing");
        let matched = levels(&mut host, &json!({ "level_cb": -80 }));
        println!("{own:.1?} dB as they are, {matched:.1?} dB where -8 dB are wanted");
        assert!(matched.iter().all(|level| (level + 8.0).abs() < 2.0), "{matched:.1?} dB, each by itself {own:.1?}");
        assert!((matched[0] - matched[1]).abs() < 2.0, "{matched:.1?} dB");

        // A missing one passes at that level, and a project of before has none.
        let saved = host.save();
        drop(host);
        fs::remove_file(folder.join("2.promenade")).unwrap();
        let mut later = H::open(Setup::default());
        assert!(later.load(&saved));
        later.instance().settle().unwrap();
        let dry = level_db(&mut later);
        assert!((dry + 8.0).abs() < 1.0, "{dry:.1} dB dry");
        let mut old = later.state();
        old["fields"].as_object_mut().unwrap().remove("matching");
        assert!(later.load(&old.to_string().into_bytes()));
        assert_eq!(field(&later.state(), "matching")["level_cb"], Value::Null);
    });
}

fn a_scene_that_the_host_chooses_is_heard_from_where_it_begins<H: Host>() {
    let fill = |folder: &Path| {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        for (from, to) in [("corridor", "1"), ("l-shaped-loft", "2")] {
            fs::copy(scenes.join(from).with_extension("promenade"), folder.join(to).with_extension("promenade")).unwrap();
        }
    };
    in_library(fill, |folder| {
        let signal = noise(24_000);
        let close = |a: &[f32; 6], b: &[f32; 6]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3);
        let mut host = H::open(Setup::default());
        let mut starts = Vec::new();
        for slot in [1, 2] {
            choose(&mut host, slot);
            let start = start_of(&folder.join(format!("{slot}.promenade")));
            assert!(close(&pose_of(&mut host), &start), "slot {slot}: {:?} for {start:?}", pose_of(&mut host));
            let heard = render(&mut host, &[&signal, &signal], &[512]);
            let mut there = H::open(Setup::default());
            choose(&mut there, slot);
            put(&mut there, &start);
            let difference = difference_db(&render(&mut there, &[&signal, &signal], &[512]), &heard);
            assert!(difference < -60.0, "slot {slot} is heard from elsewhere: {difference} dB");
            starts.push(start);
        }
        assert!(!close(&starts[0], &starts[1]) && !close(&starts[0], &[0.0; 6]), "{starts:?} tell nothing");
        // The project keeps the place, and a project of before it, which has none of its own, stays at the origin.
        let saved = host.save();
        let mut later = H::open(Setup::default());
        assert!(later.load(&saved));
        later.instance().settle().unwrap();
        assert!(close(&pose_of(&mut later), &starts[1]), "{:?}", pose_of(&mut later));
        put(&mut later, &[0.0; 6]);
        assert!(close(&pose_of(&mut later), &[0.0; 6]), "a project was moved: {:?}", pose_of(&mut later));

        // Whom the host has turned, stays; so does who is moved after the choice, in what was moved.
        let mut turned = H::open(Setup::default());
        turned.set("yaw", 0.5 + 30.0 / 360.0);
        choose(&mut turned, 1);
        assert!(close(&pose_of(&mut turned), &[0.0, 0.0, 0.0, 30.0, 0.0, 0.0]), "{:?}", pose_of(&mut turned));
        let mut walked = H::open(Setup::default());
        choose(&mut walked, 1);
        walked.set("x", 0.5 + 0.25 / 100.0);
        walked.instance().settle().unwrap();
        let expected: [f32; 6] = std::array::from_fn(|i| if i == 0 { 0.25 } else { starts[0][i] });
        assert!(close(&pose_of(&mut walked), &expected), "{:?} for {expected:?}", pose_of(&mut walked));
        choose(&mut walked, 2);
        assert!(close(&pose_of(&mut walked), &expected), "{:?} for {expected:?}", pose_of(&mut walked));
    });
}

fn a_missing_scene_passes_the_dry_sound_at_its_level<H: Host>() {
    let fill = |folder: &Path| {
        let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        fs::copy(scenes.join("concert-hall.promenade"), folder.join("hall.promenade")).unwrap();
    };
    in_library(fill, |folder| {
        let mut host = H::open(Setup::default());
        host.set("scene", 1.0);
        host.set("slot", 1.0 / 64.0);
        host.instance().settle().unwrap();
        put(&mut host, &start_of(&folder.join("hall.promenade")));
        let played = level_db(&mut host);
        let saved = host.save();
        drop(host);
        fs::remove_file(folder.join("hall.promenade")).unwrap();
        let mut later = H::open(Setup::default());
        assert!(later.load(&saved));
        later.instance().settle().unwrap();
        let dry = level_db(&mut later);
        println!("the scene plays at {played:.1} dB over the dry sound, and is missing at {dry:.1}");
        assert!((dry - played).abs() < 3.0, "{dry:.1} dB, the scene played at {played:.1} dB");
        assert!(played.abs() > 6.0, "the scene is as loud as the dry sound");
    });
}
