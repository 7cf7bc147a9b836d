//! A project finds everything again: parameters, scene and camera path.

use promenade_plugin::history::presets;
use promenade_plugin::parameter::Parameter;
use promenade_plugin::parameter::row::Values;
use promenade_plugin::project::saved_head::SavedHead;
use promenade_testing::fuzz::{Input, Search};
use promenade_testing::heads::sphere;
use promenade_testing::hostile::is_output;
use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{Host, Setup, edit_state, in_both_formats, render};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::{
    fs::OpenOptions,
    process::Command,
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    thread::JoinHandle,
    time::Duration,
};

in_both_formats!(
    every_parameter_survives,
    scene_and_camera_path_survive,
    a_head_survives_and_is_heard,
    a_drawn_room_survives_and_is_heard,
    a_room_that_cannot_be_passes_the_dry_sound,
    a_restored_state_is_heard_at_once,
    a_new_instance_plays_the_loft_and_old_projects_their_room,
    a_missing_scene_passes_the_dry_sound_and_stays_in_the_state,
    a_changed_scene_is_played_and_the_old_one_still_asked_for,
    a_state_is_the_same_after_it_is_loaded_and_has_no_reports,
    hostile_states_do_no_harm,
    states_of_later_versions_are_read_as_far_as_known,
);

/// Pipes and devices are files of these systems.
#[cfg(unix)]
mod special_files {
    use super::*;
    in_both_formats!(a_pipe_or_a_device_as_the_scene_passes_the_dry_sound);
}

/// A share of a parameter's range that is one of its steps, and not its default where no file has to be there for it.
fn changed(parameter: Parameter) -> f64 {
    let (_, most) = parameter.limits();
    let plain = match parameter.row().values {
        Values::Number(..) => return 0.3,
        Values::Slot(_) => 0.0,
        Values::Switch | Values::Choice(_) => (parameter.row().default + 1.0) % (most + 1.0),
    };
    f64::from(parameter.normalized(plain))
}

fn scene_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/scenes").join(name).canonicalize().unwrap()
}

/// A state that asks for a scene file of the library.
fn with_library_scene(state: &Value, reference: &Value) -> Vec<u8> {
    let mut state = state.clone();
    state["params"]["scene"] = json!({ "string": "library" });
    edit_state(&state, "scene", reference)
}

fn field(state: &Value, name: &str) -> Value {
    serde_json::from_str(state["fields"][name].as_str().unwrap()).unwrap()
}

fn every_parameter_survives<H: Host>() {
    let mut host = H::open(Setup::default());
    for parameter in Parameter::ALL {
        host.set(parameter.id(), changed(parameter));
    }
    host.process(&[&[0.0; 512], &[0.0; 512]]);
    let saved = host.save();
    let mut restored = H::open(Setup::default());
    assert!(restored.load(&saved));
    restored.process(&[&[0.0; 512], &[0.0; 512]]);
    for (id, value) in Parameter::ALL.map(|parameter| (parameter.id(), changed(parameter))) {
        assert!((restored.value(id) - value).abs() < 1e-3, "{id} is {}, was {value}", restored.value(id));
    }
    let (before, after) = (host.state(), restored.state());
    assert_eq!(before, after);
}

fn scene_and_camera_path_survive<H: Host>() {
    let mut host = H::open(Setup::default());
    let walk = json!({
        "keyframes": [
            { "t": 0.0, "position": [0.0, 0.0, 0.0], "ypr": [0.0, 0.0, 0.0] },
            { "t": 2.5, "position": [0.25, 0.5, 0.0], "ypr": [90.0, 0.0, 0.0] },
        ],
        "speed": 0.5, "looping": true, "slot": 0,
    });
    let file = scene_file("iosr-room-b.promenade");
    let state = serde_json::from_slice(&with_library_scene(&host.state(), &json!({ "absolute": file }))).unwrap();
    assert!(host.load(&edit_state(&state, "walk", &walk)));
    let saved = host.state();
    let scene = field(&saved, "scene");
    assert_eq!(scene["absolute"], json!(file));
    assert_eq!(scene["hash"].as_str().unwrap().len(), 64, "the content is named once it is known");
    assert_eq!(field(&saved, "walk"), walk);
    let mut again = H::open(Setup::default());
    assert!(again.load(&host.save()));
    assert_eq!(again.state(), saved);
}

fn a_head_survives_and_is_heard<H: Host>() {
    let signal = noise(12_000);
    let mut host = H::open(Setup::default());
    host.set("yaw", 0.75);
    let own = render(&mut host, &[&signal, &signal], &[512]);
    let head: String = SavedHead::of(&sphere(0.11)).into();
    let state = edit_state(&host.state(), "head", &json!(head));
    assert!(host.load(&state));
    host.reopen(Setup::default());
    let heard = render(&mut host, &[&signal, &signal], &[512]);
    assert!(difference_db(&own, &heard) > -30.0, "another head sounds the same");
    let saved = host.save();
    assert_eq!(field(&host.state(), "head"), json!(head));
    let mut again = H::open(Setup::default());
    assert!(again.load(&saved));
    again.reopen(Setup::default());
    assert!(difference_db(&heard, &render(&mut again, &[&signal, &signal], &[512])) < -120.0);
    // A state of before there were heads means the scene's own.
    let mut old = host.state();
    old["fields"].as_object_mut().unwrap().remove("head");
    assert!(host.load(&old.to_string().into_bytes()));
    host.reopen(Setup::default());
    assert!(difference_db(&own, &render(&mut host, &[&signal, &signal], &[512])) < -120.0);
}

/// A state that plays a drawn room.
fn with_room(state: &Value, room: &Value) -> Vec<u8> {
    let mut state = state.clone();
    state["params"]["scene"] = json!({ "string": "library" });
    edit_state(&state, "room", room)
}

fn a_drawn_room_survives_and_is_heard<H: Host>() {
    let signal = noise(12_000);
    let play = |host: &mut H| {
        host.reopen(Setup::default());
        render(host, &[&signal, &signal], &[512])
    };
    let mut host = H::open(Setup::default());
    let room = json!({
        "size": [5.0, 4.0, 2.5], "corner": [-2.0, -2.0, -1.0], "emitter": [1.5, 0.5, 0.25],
        "materials": ["marble_floor", "plasterboard", "0.2", "0.3:0.4", "carpet_thin", "plasterboard"],
    });
    let state = with_room(&host.state(), &room);
    assert!(host.load(&state));
    let heard = play(&mut host);
    assert_eq!(field(&host.state(), "room"), room);
    let mut again = H::open(Setup::default());
    assert!(again.load(&host.save()));
    assert!(difference_db(&heard, &play(&mut again)) < -120.0, "the project does not play as it was saved");
    let mut moved = room.clone();
    moved["emitter"] = json!([1.5, -0.5, 0.25]);
    let state = with_room(&again.state(), &moved);
    assert!(again.load(&state));
    assert!(difference_db(&heard, &play(&mut again)) > -20.0, "the emitter is not heard to move");
    // A state of before rooms could be drawn has none.
    let mut old = again.state();
    old["fields"].as_object_mut().unwrap().remove("room");
    old["params"]["scene"] = json!({ "string": "iosr-room-a" });
    assert!(again.load(&old.to_string().into_bytes()));
    assert_eq!(field(&again.state(), "room"), Value::Null);
}

fn a_room_that_cannot_be_passes_the_dry_sound<H: Host>() {
    let signal = noise(4_000);
    for wrong in [
        json!({ "size": [0.0, 4.0, 2.5] }),
        json!({ "size": [1e9, 4.0, 2.5] }),
        json!({ "size": [1e300, 4.0, 2.5] }),
        json!({ "size": [5.0, 4.0, 2.5], "emitter": [90.0, 0.0, 0.0] }),
        json!({ "corner": [1e30, 0.0, 0.0] }),
        json!({ "materials": ["marbel", "0.1", "0.1", "0.1", "0.1", "0.1"] }),
        json!({ "materials": ["2", "-1", "0.1/0.2", "", ":", "0.1:"] }),
    ] {
        let mut host = H::open(Setup::default());
        let state = with_room(&host.state(), &wrong);
        assert!(host.load(&state));
        host.reopen(Setup::default());
        let latency = host.latency();
        let heard = render(&mut host, &[&signal, &signal], &[512]);
        let dry = [vec![0.0; latency], signal[..signal.len() - latency].to_vec()].concat();
        assert!(difference_db(&heard, &[dry.clone(), dry]) < -120.0, "the dry sound does not pass: {wrong}");
    }
}

fn a_restored_state_is_heard_at_once<H: Host>() {
    let signal = noise(12_000);
    let mut room_b = H::open(Setup::default());
    room_b.set("scene", 0.5);
    room_b.process(&[&[0.0; 64], &[0.0; 64]]);
    room_b.reopen(Setup::default());
    let expected = render(&mut room_b, &[&signal, &signal], &[512]);
    let saved = room_b.save();
    let mut restored = H::open(Setup::default());
    let room_a = render(&mut restored, &[&signal, &signal], &[512]);
    assert!(restored.load(&saved));
    restored.reopen(Setup::default());
    let out = render(&mut restored, &[&signal, &signal], &[512]);
    assert!(difference_db(&expected, &room_a) > -60.0, "the two rooms sound alike");
    assert!(difference_db(&expected, &out) < -120.0);
}

fn a_new_instance_plays_the_loft_and_old_projects_their_room<H: Host>() {
    let signal = noise(12_000);
    let play = |host: &mut H| {
        host.reopen(Setup::default());
        render(host, &[&signal, &signal], &[512])
    };
    let mut host = H::open(Setup::default());
    let loft = play(&mut host);
    let fresh = host.state();
    assert_eq!(field(&fresh, "scene")["title"], json!("Loft, round a corner"));
    let mut again = H::open(Setup::default());
    again.set("scene", 0.0);
    again.process(&[&[0.0; 64], &[0.0; 64]]);
    let office = play(&mut again);
    assert!(again.load(&fresh.to_string().into_bytes()));
    assert!(difference_db(&loft, &play(&mut again)) < -120.0, "a project with the loft does not play it");
    let mut named = fresh.clone();
    named["params"]["scene"] = json!({ "string": "iosr-room-a" });
    let mut unnamed = fresh.clone();
    unnamed["params"].as_object_mut().unwrap().remove("scene");
    for mut old in [named, unnamed] {
        // Before the loft such a project named no file.
        old["fields"].as_object_mut().unwrap().remove("scene");
        let mut host = H::open(Setup::default());
        assert!(host.load(&old.to_string().into_bytes()));
        assert!(difference_db(&office, &play(&mut host)) < -120.0, "an old project does not play its room");
        assert_eq!(host.state()["params"]["scene"], json!({ "string": "iosr-room-a" }));
    }
    assert!(difference_db(&loft, &office) > -20.0, "loft and office sound alike");
}

fn a_missing_scene_passes_the_dry_sound_and_stays_in_the_state<H: Host>() {
    let signal = noise(12_000);
    let mut host = H::open(Setup::default());
    let gone = json!({
        "hash": "0".repeat(64), "title": "Hall", "absolute": "/nowhere/hall.promenade",
        "from_home": "nowhere/hall.promenade", "slot": 0,
    });
    let state = with_library_scene(&host.state(), &gone);
    assert!(host.load(&state));
    host.reopen(Setup::default());
    let latency = host.latency();
    let out = render(&mut host, &[&signal, &signal], &[512]);
    let dry = [vec![0.0; latency], signal[..signal.len() - latency].to_vec()].concat();
    assert!(difference_db(&out, &[dry.clone(), dry]) < -120.0, "the dry sound does not pass");
    assert_eq!(field(&host.state(), "scene"), gone, "the reference is lost");
    // The factory scene is there again when it is chosen.
    host.set("scene", 0.0);
    host.process(&[&[0.0; 64], &[0.0; 64]]);
    host.reopen(Setup::default());
    let wet = render(&mut host, &[&signal, &signal], &[512]);
    assert!(difference_db(&wet, &out) > -60.0);
}

/// Ends a reading of a pipe that goes on for ten seconds; `true` from `join` if that was needed.
#[cfg(unix)]
fn open_if_read(pipe: &Path, done: Receiver<()>) -> JoinHandle<bool> {
    let pipe = pipe.to_owned();
    std::thread::spawn(move || {
        let mut hangs = false;
        while done.recv_timeout(Duration::from_secs(10)) == Err(RecvTimeoutError::Timeout) {
            hangs = true;
            // For reading too, so that opening it does not wait.
            drop(OpenOptions::new().read(true).write(true).open(&pipe).unwrap());
        }
        hangs
    })
}

#[cfg(unix)]
fn a_pipe_or_a_device_as_the_scene_passes_the_dry_sound<H: Host>() {
    let folder = std::env::temp_dir().join(format!("promenade-pipe-{:?}-{}", H::FORMAT, std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let pipe = folder.join("hall.promenade");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let signal = noise(12_000);
    for path in [pipe.as_path(), Path::new("/dev/zero")] {
        for hash in [String::new(), "0".repeat(64)] {
            let (ends, done) = channel();
            let hangs = open_if_read(&pipe, done);
            let mut host = H::open(Setup::default());
            let wanted = json!({ "hash": hash, "title": "Hall", "absolute": path, "from_home": "", "slot": 0 });
            let state = with_library_scene(&host.state(), &wanted);
            assert!(host.load(&state));
            host.reopen(Setup::default());
            let latency = host.latency();
            let out = render(&mut host, &[&signal, &signal], &[512]);
            drop(ends);
            assert!(!hangs.join().unwrap(), "{} is read", path.display());
            let dry = [vec![0.0; latency], signal[..signal.len() - latency].to_vec()].concat();
            assert!(difference_db(&out, &[dry.clone(), dry]) < -120.0, "the dry sound does not pass");
            assert_eq!(field(&host.state(), "scene"), wanted, "the reference is lost");
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

fn a_changed_scene_is_played_and_the_old_one_still_asked_for<H: Host>() {
    let signal = noise(12_000);
    let mut host = H::open(Setup::default());
    let file = scene_file("iosr-room-b.promenade");
    let changed = json!({ "hash": "1".repeat(64), "title": "", "absolute": file, "from_home": "", "slot": 0 });
    let state = with_library_scene(&host.state(), &changed);
    assert!(host.load(&state));
    host.reopen(Setup::default());
    let out = render(&mut host, &[&signal, &signal], &[512]);
    let mut room_b = H::open(Setup::default());
    room_b.set("scene", 0.5);
    room_b.instance().settle().unwrap();
    let expected = render(&mut room_b, &[&signal, &signal], &[512]);
    assert!(difference_db(&expected, &out) < -120.0, "the changed scene is not heard");
    let mut kept = field(&host.state(), "scene");
    assert!(kept.as_object_mut().unwrap().remove("level_cb").is_some_and(|level| level.is_i64()), "{kept}");
    assert_eq!(kept, changed, "the project forgets the scene it was made with");
}

fn a_state_is_the_same_after_it_is_loaded_and_has_no_reports<H: Host>() {
    let mut host = H::open(Setup::default());
    // As a validator sets them: the library has no such files.
    for (id, value) in [("scene", 1.0), ("slot", 1.0), ("walk", 1.0)] {
        host.set(id, value);
    }
    host.instance().settle().unwrap();
    let saved = host.save();
    let fields = |state: &Value| state["fields"].as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert_eq!(
        fields(&host.state()),
        [
            "budget",
            "editor",
            "head",
            "headphones",
            "leader",
            "matching",
            "osc",
            "project",
            "remote",
            "room",
            "scene",
            "slots",
            "sources",
            "version",
            "walk",
            "walks"
        ]
    );
    // States of earlier plugins have reports.
    let old: Value =
        serde_json::from_slice(&edit_state(&host.state(), "scene-report", &json!("/home/ada/hall is missing"))).unwrap();
    let old = edit_state(&old, "walk-report", &json!("library slot 64 is empty"));
    for state in [saved.clone(), old] {
        let mut again = H::open(Setup::default());
        assert!(again.load(&state));
        let first = again.save();
        assert_eq!(String::from_utf8_lossy(&first), String::from_utf8_lossy(&saved));
        assert!(again.load(&first));
        again.instance().settle().unwrap();
        assert_eq!(String::from_utf8_lossy(&again.save()), String::from_utf8_lossy(&saved));
    }
}

fn hostile_states_do_no_harm<H: Host>() {
    let mut host = H::open(Setup::default());
    let good = host.state();
    let mut states = vec![
        Vec::new(),
        b"\0\xff\xfe garbage".to_vec(),
        b"{\"version\":\"0.1.0\"".to_vec(),
        b"[[[[[[".to_vec(),
        b"{\"version\":1,\"params\":[],\"fields\":7}".to_vec(),
        br#"{"version":"0.1.0","params":{"x":{"f32":1e39},"yaw":{"f32":-1e30},"tier":{"i32":99}},"fields":{}}"#.to_vec(),
        br#"{"version":"0.1.0","params":{"x":{"bool":true},"tier":{"string":"?"},"slot":{"i32":-5}},"fields":{}}"#.to_vec(),
    ];
    let odd = [
        json!(null),
        json!(17),
        json!({ "hash": 3 }),
        json!({ "absolute": "/" }),
        json!({ "absolute": "../../etc/passwd" }),
        json!({ "absolute": "/dev/null", "hash": "", "slot": 4_000_000_000_u32 }),
        json!({ "keyframes": [{ "t": 1e300, "position": [1e38, -1e38, 0.0], "ypr": [1e38, 0.0, 0.0] }] }),
        json!({ "keyframes": [{ "t": 0.0, "position": [0.0, 0.0, 0.0] }], "speed": 1e308 }),
    ];
    states.extend(odd.iter().flat_map(|value| [with_library_scene(&good, value), edit_state(&good, "walk", value)]));
    let whole = good.to_string().into_bytes();
    states.extend((0..whole.len()).step_by(97).map(|len| whole[..len].to_vec()));
    let signal = noise(512);
    for state in states {
        host.load(&state);
        host.set("follow", 1.0);
        let out = host.process(&[&signal, &signal]);
        let finite = out.iter().flatten().all(|s| s.is_finite());
        assert!(finite, "after {}", String::from_utf8_lossy(&state));
        host.save();
    }
    assert!(host.load(&good.to_string().into_bytes()));
    let out = render(&mut host, &[&signal.repeat(8), &signal.repeat(8)], &[512]);
    assert!(out[0].iter().any(|s| s.abs() > 0.01));
}

fn states_of_later_versions_are_read_as_far_as_known<H: Host>() {
    let mut host = H::open(Setup::default());
    let mut state = host.state();
    assert_eq!(field(&state, "version"), json!(3));
    state["params"]["gain"] = json!({ "f32": -6.0 });
    state["params"]["of-tomorrow"] = json!({ "f32": 1.0 });
    state["fields"]["of-tomorrow"] = json!("{}");
    assert!(host.load(&edit_state(&state, "version", &json!(7))));
    assert!((host.value("gain") - 54.0 / 72.0).abs() < 1e-6);
    assert_eq!(field(&host.state(), "version"), json!(3));
}

#[test]
fn saved_states_and_presets() {
    let mut host = promenade_tests::ClapHost::open(Setup { offline: true, ..Setup::default() });
    let base = host.state();
    let walk = json!({
        "keyframes": [
            { "t": 0.0, "position": [0.0, 0.0, 0.0], "ypr": [0.0, 0.0, 0.0] },
            { "t": 2.5, "position": [0.25, 0.5, 0.0], "ypr": [90.0, 0.0, 0.0] },
        ],
        "speed": 0.5, "looping": true, "slot": 0,
    });
    let room = json!({
        "size": [5.0, 4.0, 2.5], "corner": [-2.0, -2.0, -1.0], "emitter": [1.5, 0.5, 0.25],
        "materials": ["marble_floor", "plasterboard", "0.2", "0.3:0.4", "carpet_thin", "plasterboard"],
    });
    let head: String = SavedHead::of(&sphere(0.11)).into();
    let filters = json!([["Peak", 900.0, 3.0, 1.0], ["LowShelf", 105.0, -6.0, 0.7]]);
    let headphones = json!({ "name": "Mine", "headphones": { "equaliser": { "preamp_db": -3.0, "filters": filters } } });
    let preset = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/plugin/Class room, walk round the source.vstpreset");
    let seeds = vec![
        Input::new("state", base.to_string()),
        Input::new("walk", edit_state(&base, "walk", &walk)),
        Input::new("room", edit_state(&base, "room", &room)),
        Input::new("head", edit_state(&base, "head", &json!(head))),
        Input::new("headphones", edit_state(&base, "headphones", &headphones)),
        Input::new("a.vstpreset", std::fs::read(preset).unwrap()),
    ];
    let signal = noise(512);
    Search { name: "state", cases: 120, most_bytes: usize::MAX }.run(seeds, |input, path| {
        let taken = if input.name.ends_with("preset") {
            presets::read_file(path).map_err(|e| e.to_string()).map(|_| ())
        } else {
            host.load(&input.bytes).then_some(()).ok_or_else(|| "the plugin does not take it".to_owned())
        };
        for _ in 0..3 {
            let out = host.process(&[&signal, &signal]);
            assert!(out.iter().flatten().all(|x| is_output(*x)), "the plugin plays what is no sound");
        }
        let saved = host.save();
        if taken.is_ok() {
            assert!(host.load(&saved), "what was saved is not taken");
        }
        taken
    });
}
