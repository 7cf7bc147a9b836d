//! `promenade train` as a user runs it.

use promenade_baker::anchors::{AnchorOptions, AnchorSet, box_points};
use promenade_baker::capture::{Clip, Emitter, Split, Track, Voice};
use promenade_baker::{Capture, wav};
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_core::random::Random;
use promenade_core::{CameraPath, Keyframe, Pose, Scene};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A small network, a few short clips.
const SETTINGS: &str = r#"{"network": {"width": 16, "heads": 2, "layers": 1, "feed_forward": 32, "bands": 8, "taps": 4},
    "loss": {"n_fft": [64]}, "batch": 2, "look_every": 20}"#;

fn promenade() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_promenade"));
    command.args(["train", "capture", "--anchors", "anchors.safetensors"]);
    command.args(["-o", "scene.promenade", "--settings", "settings.json"]);
    command
}

fn train(folder: &Path, more: &[&str]) -> Output {
    promenade().args(more).current_dir(folder).output().unwrap()
}

fn capture() -> Capture {
    let (clip, clips) = (800, 10);
    let mut random = Random::new(5);
    let dry: Vec<f32> = (0..clip * clips).map(|_| 0.2 * random.normal()).collect();
    let pose = |i: usize| Pose::from_ypr(Vec3::new(1.0 + 0.1 * i as f32, 1.0, 1.5), 0.5 * i as f32, 0.0, 0.0);
    let binaural = [1.0, 0.5].map(|gain: f32| dry.iter().map(|x| gain * x).collect::<Vec<f32>>());
    let keyframe = |i: usize| Keyframe { t_s: (i * clip) as f64 / 8000.0, pose: pose(i) };
    let clips = (0..clips).map(|i| Clip {
        name: format!("{i}"),
        track: 0,
        start: i * clip,
        len: clip,
        pose: pose(i),
        split: if i % 5 == 1 { Split::Test } else { Split::Train },
    });
    Capture {
        title: "Corner".to_owned(),
        credit: "Somebody".to_owned(),
        licence: "CC0-1.0".to_owned(),
        sample_rate_hz: 8000.0,
        emitters: vec![Emitter::at(Vec3::new(2.0, 2.0, 1.5))],
        clips: clips.collect(),
        tracks: vec![Track {
            name: "t".to_owned(),
            voices: vec![Voice { emitter: Some(0), dry }],
            binaural,
            path: CameraPath::new((0..10).map(keyframe).collect()).unwrap(),
        }],
        notes: Vec::new(),
    }
}

fn prepared() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    capture().write(&folder.path().join("capture")).unwrap();
    let points = box_points(Vec3::new(3.0, 3.0, 2.5), 0.25, &[[0.2, 0.5, 0.8]; 6]).unwrap();
    let options = AnchorOptions { count: 12, neighbours: 4, ..AnchorOptions::default() };
    let (anchors, _) = AnchorSet::from_points(&points, Placement::IDENTITY, &options).unwrap();
    anchors.save(&folder.path().join("anchors.safetensors")).unwrap();
    std::fs::write(folder.path().join("settings.json"), SETTINGS).unwrap();
    folder
}

#[test]
fn a_training_that_is_killed_goes_on_to_the_same_scene() {
    let folder = prepared();
    let at = |name: &str| folder.path().join(name);
    let whole = train(folder.path(), &["--steps", "120", "--curve", "course.svg"]);
    assert!(whole.status.success(), "{}", String::from_utf8_lossy(&whole.stderr));
    assert!(String::from_utf8_lossy(&whole.stderr).contains("step 120 of 120: loss"));
    assert!(std::fs::read_to_string(at("course.svg")).unwrap().contains("<polyline"));
    let wanted = std::fs::read(at("scene.promenade")).unwrap();
    let scene = Scene::from_bytes(&wanted).unwrap();
    assert_eq!((scene.title(), scene.credit(), scene.licence()), ("Corner", "Somebody", "CC0-1.0"));
    assert!(scene.emitter().is_some() && scene.anchors().len() == 12);
    // What a training says of the test clips is what is judged of its scene.
    let said = String::from_utf8_lossy(&whole.stderr).into_owned();
    let (_, last) = said.rsplit_once("test MAG ").unwrap();
    let judged = Command::new(env!("CARGO_BIN_EXE_promenade"))
        .args(["eval", "scene.promenade", "capture", "--no-baselines", "--json", "e.json"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(judged.status.success(), "{}", String::from_utf8_lossy(&judged.stderr));
    let judged: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(at("e.json")).unwrap()).unwrap();
    let mean = &judged["evaluations"][0]["methods"][0]["mean"];
    let [mag, lre, env] = ["avcloud_mag", "avcloud_lre_db", "avcloud_env"].map(|name| mean[name].as_f64().unwrap());
    assert_eq!(last.lines().next().unwrap(), format!("{mag:.4}, LRE {lre:.3} dB, ENV {env:.4}"));

    for name in ["scene.promenade", "scene.training"] {
        std::fs::remove_file(at(name)).unwrap();
    }
    // Killed again and again, as soon as something has been kept.
    let args = ["--steps", "120", "--keep-every", "5"];
    for _ in 0..3 {
        let before = std::fs::metadata(at("scene.training")).and_then(|m| m.modified()).ok();
        let mut running = promenade().args(args).current_dir(folder.path()).stderr(Stdio::null()).spawn().unwrap();
        let began = Instant::now();
        while std::fs::metadata(at("scene.training")).and_then(|m| m.modified()).ok() == before {
            assert!(began.elapsed() < Duration::from_secs(300), "nothing is kept");
            if running.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        running.kill().unwrap();
        running.wait().unwrap();
    }
    let rest = train(folder.path(), &args);
    assert!(rest.status.success(), "{}", String::from_utf8_lossy(&rest.stderr));
    let said = String::from_utf8_lossy(&rest.stderr).into_owned();
    assert!(said.contains("goes on from step"), "{said}");
    assert_eq!(Scene::from_bytes(&std::fs::read(at("scene.promenade")).unwrap()).unwrap().cloud(), scene.cloud());
}

#[test]
fn what_is_wrong_is_named() {
    let folder = prepared();
    let small = SETTINGS.replace("\"taps\": 4", "\"taps\": 0");
    std::fs::write(folder.path().join("settings.json"), small).unwrap();
    let found = train(folder.path(), &["--steps", "4"]);
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
    let other = train(folder.path(), &["--steps", "8", "--seed", "9"]);
    let said = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(!other.status.success() && said.contains("scene.training") && said.contains("--restart"), "{said}");

    std::fs::write(folder.path().join("settings.json"), r#"{"network": {"width": 20}}"#).unwrap();
    let odd = train(folder.path(), &["--restart"]);
    let said = String::from_utf8_lossy(&odd.stderr).into_owned();
    assert!(!odd.status.success() && said.contains("width") && said.contains("20"), "{said}");

    for threads in ["0", "257", "999999999"] {
        let refused = train(folder.path(), &["--restart", "--threads", threads]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains("expected a number from 1 to 256"), "{said}");
    }

    // Nothing is trained on silence.
    let silence = vec![0.0; 8000];
    wav::write(&folder.path().join("capture/t.binaural.wav"), 8000, &[&silence, &silence], wav::Format::Float32).unwrap();
    std::fs::write(folder.path().join("settings.json"), SETTINGS).unwrap();
    let silent = train(folder.path(), &["--restart"]);
    let said = String::from_utf8_lossy(&silent.stderr).into_owned();
    assert!(!silent.status.success() && said.contains("silent"), "{said}");
}

/// One walk heard from each of two places, and a capture of both.
fn two_emitters(folder: &Path) {
    for (name, at) in [("sofa", Vec3::new(2.0, 2.0, 1.5)), ("desk", Vec3::new(0.5, 2.5, 1.0))] {
        let mut one = capture();
        one.emitters[0] = Emitter { name: name.to_owned(), ..Emitter::at(at) };
        one.title = name.to_owned();
        one.write(&folder.join(name)).unwrap();
    }
}

#[test]
fn a_scene_of_two_emitters_is_heard_from_anywhere_and_one_of_one_is_not() {
    let folder = prepared();
    two_emitters(folder.path());
    let run =
        |args: &[&str]| Command::new(env!("CARGO_BIN_EXE_promenade")).args(args).current_dir(folder.path()).output().unwrap();
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let learn = ["--anchors", "anchors.safetensors", "--settings", "settings.json", "--steps", "4"];
    let both = [&["train", "sofa", "desk", "-o", "both.promenade", "--test-emitter", "desk", "--emitter", "desk"], &learn[..]];
    let trained = run(&both.concat());
    assert!(trained.status.success(), "{}", said(&trained));
    let scene = Scene::from_bytes(&std::fs::read(folder.path().join("both.promenade")).unwrap()).unwrap();
    assert_eq!((scene.emitter(), scene.anchors().len()), (Some(Vec3::new(0.5, 2.5, 1.0)), 13));
    let one = train(folder.path(), &["--steps", "4"]);
    assert!(one.status.success(), "{}", said(&one));
    // What was trained within an error goes on to no more than that.
    let less = train(folder.path(), &["--steps", "4", "--within", "2"]);
    assert!(less.status.success() && said(&less).contains("within 2 JND: "), "{}", said(&less));
    let less = Scene::from_bytes(&std::fs::read(folder.path().join("scene.promenade")).unwrap()).unwrap();
    assert!(less.provenance().recipe.ends_with(" --within 2") && less.cloud().is_some(), "{}", less.provenance().recipe);
    let dry = vec![0.3; 8000];
    wav::write(&folder.path().join("in.wav"), 8000, &[&dry], wav::Format::Float32).unwrap();
    let place = ["in.wav", "out.wav", "--emitter", "1.2,1,1.5"];
    let moved = run(&[&["render", "both.promenade"], &place[..]].concat());
    assert!(moved.status.success(), "{}", said(&moved));
    let still = run(&[&["render", "scene.promenade"], &place[..]].concat());
    assert!(!still.status.success() && said(&still).contains("found one that holds for its own"), "{}", said(&still));
    // Each clip is judged at its own emitter; a scene of one emitter says of how many it is not.
    let judge = |scene: &str| {
        let judged = run(&["eval", scene, "desk", "--test-emitter", "desk", "--emitter", "desk", "--no-baselines"]);
        assert!(judged.status.success(), "{}", said(&judged));
        String::from_utf8_lossy(&judged.stdout).into_owned()
    };
    assert!(!judge("both.promenade").contains("another emitter"));
    let other = judge("scene.promenade");
    assert!(other.contains("in 10 of 10 test clips the scene is judged by another emitter's sound"), "{other}");
    let unknown = run(&[&["train", "sofa", "-o", "no.promenade", "--test-emitter", "lamp"], &learn[..]].concat());
    assert!(!unknown.status.success() && said(&unknown).contains(r#"one of ["sofa"], found "lamp""#), "{}", said(&unknown));
}

#[test]
fn a_walk_and_a_coarse_room_become_a_scene_and_go_on_where_they_were_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    crate::simulate::head(&at("head"));
    std::fs::write(at("room.obj"), crate::simulate::ROOM).unwrap();
    let run =
        |args: &[&str]| Command::new(env!("CARGO_BIN_EXE_promenade")).args(args).current_dir(folder.path()).output().unwrap();
    let done = |args: &[&str]| {
        let output = run(args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        said
    };
    let noise: Vec<f32> = promenade_testing::noise(5, 80_000).iter().map(|x| 0.2 * x).collect();
    wav::write(&at("dry.wav"), 8000, &[&noise], wav::Format::Float32).unwrap();
    // One simulation is the recordings of three emitters, in a room that is livelier than the coarse one.
    let place = ["simulate", "room.obj", "--emitter", "3,3.2,1.5", "--further", "1,1,1.2", "--further", "5,1,1.6"];
    let quick = ["--head", "head", "--rate", "8000", "--rays", "2000", "--beams", "256", "--order", "2", "--poses", "5"];
    let walk = ["--materials", "*=0.15:0.3", "--dry", "dry.wav", "--seed", "2", "-o", "walk"];
    done(&[&place[..], &quick, &walk].concat());
    let capture = Capture::load(&at("walk")).unwrap();
    assert_eq!((capture.emitters.len(), capture.tracks.len()), (3, 15));
    assert!(capture.emitters[2].position.distance(Vec3::new(5.0, 1.0, 1.6)) < 1e-4);
    std::fs::write(at("settings.json"), SETTINGS).unwrap();
    let coarse = ["--room", "room.obj", "--materials", "*=0.5", "--order", "1", "--rays", "2000", "--head", "head"];
    let learn = ["--settings", "settings.json", "--steps", "2", "--test-emitter", "source 3", "--emitter", "source 3"];
    let all = [&["learn", "walk", "-o", "walk.promenade"], &coarse[..], &learn].concat();
    let said = done(&all);
    assert!(
        said.contains("recordings, s") && said.contains("simulating 10 poses") | said.contains("simulating 5 poses"),
        "{said}"
    );
    let scene = Scene::from_bytes(&std::fs::read(at("walk.promenade")).unwrap()).unwrap();
    assert!(scene.cloud().is_none() && scene.emitter().unwrap().distance(Vec3::new(5.0, 1.0, 1.6)) < 1e-4);
    let report = std::fs::read_to_string(at("walk.report.md")).unwrap();
    assert!(report.contains("## Decays") && report.contains("| mono-mono") && report.contains("| 0 "), "{report}");
    // The room that the recordings gave is one that `simulate` reads, and absorbs less than it was said to.
    let fitted = std::fs::read_to_string(at("walk.room.materials.json")).unwrap();
    let fitted: serde_json::Value = serde_json::from_str(&fitted).unwrap();
    let (_, wall) = fitted["materials"].as_object().unwrap().iter().next().unwrap();
    let absorption: f64 = wall.as_str().unwrap().split(['/', ':']).nth(2).unwrap().parse().unwrap();
    assert!(absorption > 0.08 && absorption < 0.3, "{fitted}");
    done(&[
        "simulate",
        "walk.room.obj",
        "--emitter",
        "3,3.2,1.5",
        "--head",
        "head",
        "--length",
        "0.1",
        "--rays",
        "300",
        "-o",
        "again",
    ]);
    // A second run simulates nothing and makes the same scene.
    let kept =
        || std::fs::read_dir(at("walk.simulated")).unwrap().map(|e| e.unwrap().metadata().unwrap().modified().unwrap()).max();
    let before = kept();
    let said = done(&all);
    assert!(said.contains("goes on from step 2") && kept() == before, "{said}");
    assert_eq!(Scene::from_bytes(&std::fs::read(at("walk.promenade")).unwrap()).unwrap(), scene);
    let said = done(&[&all[..], &["--within", "2"]].concat());
    let less = Scene::from_bytes(&std::fs::read(at("walk.promenade")).unwrap()).unwrap();
    let share = format!("{:.0} % of the operations", 100.0 * less.operations(48_000.0) / scene.operations(48_000.0));
    assert!(said.contains("within 2 JND: ") && said.contains(&share), "{share}: {said}");
    // The same recordings refine the room, and a damaged simulation is named.
    let refine = [&["refine", "walk", "-o", "refined.promenade", "--emitter", "5,1,1.6", "--steps", "3"], &coarse[..]].concat();
    assert!(done(&refine).contains("clips stand out"));
    let one = std::fs::read_dir(at("walk.simulated")).unwrap().next().unwrap().unwrap().path();
    wav::write(&one, 8000, &[&[0.5], &[0.5]], wav::Format::Float32).unwrap();
    let failed = run(&all);
    let said = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert!(!failed.status.success() && said.contains("walk.simulated") && said.contains("both ears' responses"), "{said}");
    let none = run(&["learn", "walk", "-o", "n.promenade", "--anchors", "none"]);
    assert!(!none.status.success());
}
