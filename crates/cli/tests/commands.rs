//! The command-line tool from outside: what it writes, what it says, what it leaves behind.

use crate::common::{Place, RATE, all_fail, checkpoint, fails, json, promenade, rms, succeeds};
use promenade_baker::checkpoint::Imported;
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene};
use promenade_baker::sound;
use promenade_baker::wav::{self, Format};
use promenade_core::network::{CloudKind, CloudModel};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Provenance, Scene, StftGrid};
use promenade_testing::clouds;
use promenade_testing::clouds::Sizes;
use promenade_testing::heads::write_sofa;
use promenade_testing::signal::noise;
use std::path::Path;

#[test]
fn bakes_inspects_and_measures() {
    let place = Place::new();
    let scene = place.bake();
    let (text, _) = succeeds(&["inspect", &scene]);
    assert!(text.contains("test room") && text.contains("nobody") && text.contains("promenade bake responses"), "{text}");
    assert!(!text.contains(place.folder.path().to_str().unwrap()), "no path of this machine in a scene: {text}");
    let json = json(&["inspect", &scene, "--json"]);
    assert_eq!((json["title"].as_str(), json["sample_rate_hz"].as_f64()), (Some("test room"), Some(16_000.0)));
    assert_eq!(json["held_out"].as_array().unwrap().len(), 3);
    assert_eq!(json["front"].as_array().map(Vec::len), Some(0), "{json}");

    let (table, _) = succeeds(&["measure", &scene]);
    // A head, three poses, the means and what is just noticed, of figures and of levels.
    assert_eq!(table.lines().filter(|l| !l.is_empty()).count(), 6 + 6, "{table}");
    assert_eq!(table.matches("\njust noticeable ").count(), 2, "{table}");
    let (markdown, _) = succeeds(&["measure", &scene, "--markdown"]);
    assert!(markdown.starts_with("| held-out pose"), "{markdown}");
    let json = crate::common::json(&["measure", &scene, "--json"]);
    let mean = &json["mean_absolute_error"];
    assert!(mean["itd_us"].as_f64().unwrap() < 60.0 && mean["ild_db"].as_f64().unwrap() < 2.0, "{mean}");
}

#[test]
fn renders_in_time_and_keeps_the_tail() {
    let place = Place::new();
    let scene = place.bake();
    // A click at 0.25 s stands at 0.25 s, plus the direct sound's own delay, in the output.
    let mut click = vec![0.0; RATE as usize];
    click[4000] = 0.9;
    wav::write(&place.path("click.wav"), RATE, &[&click], Format::Float32).unwrap();
    let out = place.text("out.wav");
    succeeds(&["render", &scene, &place.text("click.wav"), &out, "--bits", "32f", "--pose", "0,0,0,0,0,0"]);
    let wet = sound::read(Path::new(&out)).unwrap();
    assert!(wet.frames() > click.len(), "the tail is kept");
    let peak = |x: &[f32]| (0..x.len()).max_by(|a, b| x[*a].abs().total_cmp(&x[*b].abs())).unwrap();
    let at = peak(&wet.channels[0]);
    assert!((4000..4000 + 160).contains(&at), "the click is at {at}");
    // Dry only: sample for sample the input.
    succeeds(&["render", &scene, &place.text("click.wav"), &out, "--bits", "32f", "--mix", "0"]);
    let dry = sound::read(Path::new(&out)).unwrap();
    assert_eq!(peak(&dry.channels[0]), 4000);
    assert!((dry.channels[0][4000] - 0.9).abs() < 1e-6 && rms(&dry.channels[0][..4000]) == 0.0);
}

#[test]
fn block_size_does_not_change_the_sound_but_the_pose_does() {
    let place = Place::new();
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.7, 1));
    let render = |name: &str, more: &[&str]| {
        let out = place.text(name);
        succeeds(&[&["render", &scene, &input, &out, "--bits", "32f"], more].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    std::fs::write(place.path("walk.csv"), "t,x,y,z,yaw,pitch,roll\n0,0,0,0,-90,0,0\n0.6,0,0,0,90,0,0\n").unwrap();
    let walk = place.text("walk.csv");
    let whole = render("a.wav", &["--path", &walk]);
    assert_eq!(whole, render("b.wav", &["--path", &walk, "--block", "7"]), "bit for bit");
    let level = |channels: &[Vec<f32>]| rms(&channels[0]) / rms(&channels[1]);
    let (right, left) = (render("c.wav", &["--pose", "0,0,0,-90,0,0"]), render("d.wav", &["--pose", "0,0,0,90,0,0"]));
    assert!(
        level(&right) > 1.5 && level(&left) < 0.7,
        "turned right the left ear faces the source: {} {}",
        level(&right),
        level(&left)
    );
    let backwards = render("e.wav", &["--path", &walk, "--speed", "-1"]);
    assert!((level(&backwards[..]) - level(&whole)).abs() > 1e-3, "it makes a difference");
    let louder = render("f.wav", &["--pose", "0,0,0,90,0,0", "--gain", "6.0206"]);
    assert!((rms(&louder[0]) / rms(&left[0]) - 2.0).abs() < 1e-3);
}

#[test]
fn further_sounds_are_heard_from_their_places_in_one_room() {
    let place = Place::new();
    let (scene, input, quiet) = (place.bake(), place.dry("in.wav", 0.7, 1), place.text("quiet.wav"));
    wav::write(Path::new(&quiet), RATE, &[&vec![0.0; RATE as usize / 3]], Format::Float32).unwrap();
    let render = |sound: &str, more: &[&str]| {
        let out = place.text("out.wav");
        succeeds(&[&["render", &scene, sound, &out, "--bits", "32f"], more].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    let alone = render(&input, &[]);
    let emitter = Scene::from_bytes(&std::fs::read(&scene).unwrap()).unwrap().emitter().unwrap();
    let at = |offset: f32| format!("{},{},{}={input}", emitter.x, emitter.y + offset, emitter.z);
    // It lasts longer than the first sound.
    let same = render(&quiet, &["--source", &at(0.0)]);
    // Several voices are said to sound on for a few hops more.
    assert!((alone[0].len()..alone[0].len() + RATE as usize / 10).contains(&same[0].len()));
    let apart = |a: &[Vec<f32>], b: &[Vec<f32>]| {
        let difference: Vec<f32> = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| a - b).collect();
        rms(&difference) / rms(&a[0])
    };
    assert!(apart(&alone, &same) < 1e-4, "{}", apart(&alone, &same));
    let beside = render(&quiet, &["--source", &at(1.0)]);
    assert!(apart(&alone, &beside) > 0.1, "from another place");
    let both = render(&input, &["--source", &at(1.0)]);
    let sum: Vec<Vec<f32>> = alone.iter().zip(&beside).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect();
    assert!(apart(&sum, &both) < 1e-4, "{}", apart(&sum, &both));
    // Along a path, whatever the blocks are.
    std::fs::write(place.path("way.csv"), "t,x,y,z,yaw,pitch,roll\n0,0,1,0,0,0,0\n0.6,1,-1,0,0,0,0\n").unwrap();
    let way = format!("{}={input}", place.text("way.csv"));
    let moving = render(&quiet, &["--source", &way]);
    assert!(apart(&moving, &beside) > 0.1);
    assert_eq!(moving, render(&quiet, &["--source", &way, "--block", "7"]), "bit for bit");
    let dry = render(&quiet, &["--source", &way, "--mix", "0"]);
    assert!(apart(&sound::read(Path::new(&input)).unwrap().channels, &dry[..1]) < 1e-6, "the dry sound comes at once");
    let out = place.text("out.wav");
    let missing = ["1,2,3=none.wav", "none.csv=in.wav"].map(|source| vec!["render", &scene, &input, &out, "--source", source]);
    let [no_sound, no_path] = missing;
    all_fail(&[(no_sound, "none.wav: cannot be read"), (no_path, "in.wav: cannot be read")]);
    let soon = render(&quiet, &["--source", &at(0.0), "--latency", "64"]);
    assert!(rms(&soon[0]) > 0.5 * rms(&alone[0]), "with every latency");
    let said = promenade(&["render", &scene, &input, &out, "--source", "1,2,3"]);
    assert!(String::from_utf8_lossy(&said.stderr).contains("expected X,Y,Z=SOUND"), "{said:?}");
}

#[test]
fn the_parts_of_the_sound_are_set_by_options() {
    let place = Place::new();
    let (scene, dry, out) = (place.bake(), place.dry("dry.wav", 0.5, 1), place.text("out.wav"));
    let heard = |options: &[&str]| {
        succeeds(&[&["render", &scene, &dry, &out, "--bits", "32f"], options].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    let (plain, neutral) =
        (heard(&[]), heard(&["--direct", "0", "--early", "0", "--decay", "1", "--distance-law", "1", "--width", "1"]));
    assert!(plain == neutral);
    let part = |silent: [&str; 2]| heard(&[silent[0], "-120", silent[1], "-120"]);
    let parts = [part(["--early", "--late"]), part(["--direct", "--late"]), part(["--direct", "--early"])];
    let apart = (0..plain[0].len()).map(|i| parts.iter().map(|part| part[0][i]).sum::<f32>() - plain[0][i]).collect::<Vec<_>>();
    assert!(parts.iter().all(|part| rms(&part[0]) > 1e-3 * rms(&plain[0])));
    assert!(rms(&apart) < 1e-4 * rms(&plain[0]), "the parts add up: {}", rms(&apart));
    let solo = heard(&["--wet-solo", "--mix", "0.5", "--gain", "6.0206"]);
    let want = heard(&["--direct", "-120"]);
    let apart = solo[0].iter().zip(&want[0]).map(|(a, b)| a - b).collect::<Vec<_>>();
    assert!(rms(&apart) < 1e-4 * rms(&want[0]), "neither dry nor direct sound: {}", rms(&apart));
    assert!(heard(&["--decay", "2"])[0].len() > plain[0].len(), "the longer tail is kept");
}

#[test]
fn another_head_is_heard_and_what_is_none_is_refused() {
    let place = Place::new();
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.4, 1));
    let head = place.text("head.sofa");
    write_sofa(Path::new(&head), 0.12);
    let render = |name: &str, more: &[&str]| {
        let out = place.text(name);
        succeeds(&[&["render", &scene, &input, &out, "--pose", "0,0,0,-90,0,0", "--bits", "32f"], more].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    let (own, heard) = (render("own.wav", &[]), render("heard.wav", &["--head", &head]));
    let apart: f64 = own[0].iter().zip(&heard[0]).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    assert!(apart > 1e-3 * own[0].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>());
    let broken = place.text("broken.sofa");
    std::fs::write(&broken, b"no head").unwrap();
    let out = place.text("none.wav");
    all_fail(&[
        (vec!["render", &scene, &input, &out, "--head", &broken], "broken.sofa: no readable SOFA (HDF5) file"),
        (vec!["render", &scene, &input, &out, "--head", &input], "in.wav: no readable SOFA (HDF5) file"),
        (vec!["render", &scene, &input, &out, "--head", "nowhere.sofa"], "nowhere.sofa: cannot be read"),
    ]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn headphones_are_compensated_last_of_all() {
    let place = Place::new();
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.4, 1));
    let render = |name: &str, more: &[&str]| {
        let out = place.text(name);
        succeeds(&[&["render", &scene, &input, &out, "--mix", "0.5", "--bits", "32f"], more].concat());
        sound::read(Path::new(&out)).unwrap().channels
    };
    let text = place.text("mine.txt");
    std::fs::write(&text, "Preamp: -6.0206 dB\nFilter 1: ON PK Fc 1000 Hz Gain 0 dB Q 1").unwrap();
    let (plain, worn) = (render("plain.wav", &[]), render("worn.wav", &["--headphones", &text]));
    let off = |ear: usize| plain[ear].iter().zip(&worn[ear]).map(|(a, b)| (0.5 * a - b).abs()).fold(0.0, f32::max);
    assert!(off(0) < 1e-5 && off(1) < 1e-5, "{} {}", off(0), off(1));
    let out = place.text("none.wav");
    all_fail(&[
        (vec!["render", &scene, &input, &out, "--headphones", &input], "in.wav: no readable SOFA (HDF5) file"),
        (vec!["render", &scene, &input, &out, "--headphones", "nowhere.txt"], "nowhere.txt: cannot be read"),
    ]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn stereo_and_formats() {
    let place = Place::new();
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.2, 2));
    for (bits, tolerance) in [("16", 1.0 / 32768.0), ("24", 1.0 / 8_388_608.0)] {
        let (out, float) = (place.text("out.wav"), place.text("float.wav"));
        succeeds(&["render", &scene, &input, &out, "--bits", bits]);
        succeeds(&["render", &scene, &input, &float, "--bits", "32f"]);
        let (a, b) = (sound::read(Path::new(&out)).unwrap(), sound::read(Path::new(&float)).unwrap());
        assert!(a.channels[0].iter().zip(&b.channels[0]).all(|(a, b)| (a - b).abs() <= tolerance), "{bits}");
    }
    let (_, said) = succeeds(&["render", &scene, &input, &place.text("loud.wav"), "--gain", "60"]);
    assert!(said.contains("limited"), "{said}");
}

#[test]
fn the_list_says_which_scenes_have_no_treble() {
    let scene = |name: &str| format!("{}/../../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    let (list, _) = succeeds(&["inspect", &scene("iosr-room-a"), &scene("loft")]);
    let lines: Vec<&str> = list.lines().collect();
    assert_eq!(lines.len(), 3);
    assert!(lines[1].contains("16 kHz") && lines[1].contains("6.8 kHz") && lines[1].contains("office"), "{list}");
    assert!(lines[2].contains("48 kHz") && lines[2].contains("20.2 kHz") && lines[2].contains("Loft"), "{list}");
}

#[test]
fn measures_a_response() {
    let place = Place::new();
    let file = place.text("turn_-90.wav");
    let json = json(&["measure", "--response", &file, "--reference", &file]);
    assert!(
        json["response"]["itd_us"].as_f64().unwrap() < -400.0 && json["response"]["ild_db"].as_f64().unwrap() > 3.0,
        "{json}"
    );
    assert_eq!(json["distance"]["avcloud_mag"].as_f64(), Some(0.0));
    wav::write(&place.path("short.wav"), RATE, &[&[0.0, 1.0, 0.5], &[0.0, 1.0, 0.5]], Format::Float32).unwrap();
    let json = crate::common::json(&["measure", "--response", &place.text("short.wav")]);
    assert!(json["response"]["c50_db"].is_null() && json["response"]["missing"]["c50_db"].is_string(), "{json}");
}

#[test]
fn bad_input_is_one_line_and_leaves_nothing() {
    let place = Place::new();
    let (scene, input) = (place.bake(), place.dry("in.wav", 0.2, 1));
    let mut nan = vec![0.1_f32; 8000];
    nan[7000] = f32::NAN;
    std::fs::write(place.path("nan.wav"), float_wav(&nan)).unwrap();
    place.dry("three.wav", 0.1, 3);
    std::fs::write(place.path("empty.wav"), []).unwrap();
    std::fs::write(place.path("broken.promenade"), b"not a scene").unwrap();
    let whole = std::fs::read(&scene).unwrap();
    std::fs::write(place.path("cut.promenade"), &whole[..whole.len() / 2]).unwrap();
    std::fs::write(place.path("bad.csv"), "t,x,y,z,yaw,pitch,roll\n0,0,0,oops,0,0,0\n").unwrap();
    let before = place.names();
    let (out, set) = (place.text("out.wav"), place.folder.path().to_str().unwrap().to_owned());
    let p = |name: &str| place.text(name);
    for (args, clue) in [
        (vec!["render", &scene, &p("none.wav"), &out], "none.wav: cannot be read"),
        (vec!["render", &scene, &p("empty.wav"), &out], "an empty file"),
        (vec!["render", &scene, &p("nan.wav"), &out], "sample 7000"),
        (vec!["render", &scene, &p("three.wav"), &out], "expected 1 or 2 channels, found 3"),
        (vec!["render", &p("none.promenade"), &input, &out], "none.promenade: cannot be read"),
        (vec!["render", &p("broken.promenade"), &input, &out], "broken.promenade: no readable scene"),
        (vec!["render", &p("cut.promenade"), &input, &out], "cut.promenade: no readable scene"),
        (
            vec!["render", &scene, &input, &out, "--path", &p("bad.csv")],
            "line 2: expected a finite number for z, found \"oops\"",
        ),
        (vec!["render", &scene, &input, &p("in.wav/out.wav")], "out.wav: cannot be written"),
        (vec!["render", &scene, &input, &set], "a folder"),
        (vec!["bake", "responses", &p("none"), "-o", &out], "none: cannot be read"),
        (
            vec!["bake", "responses", &set, "-o", &out, "--hold-out", "azimuth=17"],
            "hold-out: expected a rule that selects some of the 13 responses",
        ),
        (vec!["bake", "responses", &set, "-o", &out, "--hold-out", "sideways=3"], "hold-out: expected"),
        (vec!["bake", "responses", &set, "-o", &p("no/such/x.promenade")], "cannot be written"),
        (vec!["bake", "responses", &set, "-o", &out, "--root", &p("nowhere")], "nowhere: cannot be read"),
        (vec!["inspect", &p("in.wav")], "in.wav: expected a scene, which is the first file and ends in .promenade"),
        (vec!["measure", "--response", &p("in.wav")], "expected the 2 channels of a binaural file, found 1"),
    ] {
        let said = fails(&args);
        assert!(said.contains(clue), "{args:?}: {said}");
        assert_eq!(place.names(), before, "{args:?} left something behind");
    }
}

#[cfg(unix)]
#[test]
fn inputs_that_are_no_regular_files_are_refused_at_once() {
    let place = Place::new();
    let (scene, input, out) = (place.bake(), place.dry("in.wav", 0.2, 1), place.text("out.wav"));
    for name in ["pipe", "pipe.csv", "pipe.json", "pipe.sofa"] {
        assert!(std::process::Command::new("mkfifo").arg(place.path(name)).status().unwrap().success());
    }
    std::fs::create_dir(place.path("set")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", place.path("set/capture.json")).unwrap();
    let p = |name: &str| place.text(name);
    let [pipe, csv, json, sofa] = ["pipe", "pipe.csv", "pipe.json", "pipe.sofa"].map(p);
    for args in [
        vec!["inspect", &pipe],
        vec!["inspect", "/dev/zero"],
        vec!["inspect", place.folder.path().to_str().unwrap()],
        vec!["path", &csv],
        vec!["path", "/dev/zero"],
        vec!["render", &pipe, &input, &out],
        vec!["render", &scene, &pipe, &out],
        vec!["render", &scene, "/dev/zero", &out],
        vec!["render", &scene, &input, &out, "--path", &json],
        vec!["bake", "responses", &json, "-o", &out],
        vec!["bake", "responses", &sofa, "-o", &out],
        vec!["bake", "field", &pipe, "-o", &out],
        vec!["capture", "check", &json],
        vec!["capture", "check", &p("set")],
        vec!["capture", "from-responses", &json, "-o", &out],
        vec!["host", "none.clap", &input, &out, "--state", &pipe],
        vec!["host", "none.clap", &input, &out, "--automation", &json],
        vec!["measure", "--response", &pipe],
    ] {
        let said = fails(&args);
        assert!(said.contains("expected a regular file, found"), "{args:?}: {said}");
    }
    assert!(!place.path("out.wav").exists());
}

#[test]
fn titles_cannot_steer_the_terminal() {
    let place = Place::new();
    let scene = place.text("room.promenade");
    let folder = place.folder.path().to_str().unwrap();
    succeeds(&["bake", "responses", folder, "-o", &scene, "--title", "\u{1b}]0;owned\u{7}\nanchors 9 \u{9b}31m"]);
    let (text, _) = succeeds(&["inspect", &scene]);
    assert!(text.starts_with("title         \\u001b]0;owned\\u0007 anchors 9 \\u009b31m\n"), "{text}");
    let title = json(&["inspect", &scene, "--json"])["title"].as_str().map(str::to_owned);
    assert_eq!(title.as_deref(), Some("\u{1b}]0;owned\u{7}\nanchors 9 \u{9b}31m"));
    let said = fails(&["inspect", &place.text("\u{1b}[2Jnone")]);
    assert!(said.contains("\\u001b[2Jnone: cannot be read"), "{said}");
}

/// A render that is killed leaves a draft, which the next one removes.
#[cfg(unix)]
#[test]
fn a_killed_render_leaves_nothing_for_long() {
    let place = Place::new();
    let (scene, long, short) = (place.bake(), place.dry("long.wav", 600.0, 1), place.dry("short.wav", 0.1, 1));
    let before = place.names();
    let out = place.text("out.wav");
    let mut render = std::process::Command::new(env!("CARGO_BIN_EXE_promenade"))
        .args(["render", &scene, &long, &out])
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let waited = std::time::Instant::now();
    while place.names() == before && waited.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    render.kill().unwrap();
    render.wait().unwrap();
    assert!(!place.path("out.wav").exists(), "it was killed in time");
    assert_eq!(place.names().len(), before.len() + 1, "{:?}", place.names());
    succeeds(&["render", &scene, &short, &out]);
    assert_eq!(place.names().len(), before.len() + 1, "{:?}", place.names());
    assert!(place.path("out.wav").exists());
}

#[test]
fn a_wrong_command_line_is_status_2() {
    for args in [
        &["render"][..],
        &["render", "a", "b", "c", "--mix", "2"],
        &["render", "a", "b", "c", "--mix", "NaN"],
        &["render", "a", "b", "c", "--pose", "1,2"],
        &["render", "a", "b", "c", "--bits", "12"],
        &["render", "a", "b", "c", "--tier", "draft"],
        &["render", "a", "b", "c", "--block", "0"],
        &["render", "a", "b", "c", "--loop"],
        &["path"],
        &["path", "a", "--up", "0,0,0"],
        &["path", "a", "--origin", "last"],
        &["path", "a", "--simplify", "1"],
        &["path", "a", "--fps", "0"],
        &["render", "a", "b", "c", "--source", "1,2,3"],
        &["measure"],
        &["measure", "a", "--response", "b"],
    ] {
        let out = promenade(args);
        assert_eq!(out.status.code(), Some(2), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    }
}

/// A WAV file of 32-bit floats without asking whether they are numbers.
fn float_wav(samples: &[f32]) -> Vec<u8> {
    let data: Vec<u8> = samples.iter().flat_map(|v| v.to_le_bytes()).collect();
    let size = u32::try_from(data.len()).unwrap();
    let mut bytes = b"RIFF".to_vec();
    bytes.extend((36 + size).to_le_bytes());
    bytes.extend(b"WAVEfmt ");
    bytes.extend(16_u32.to_le_bytes());
    bytes.extend(3_u16.to_le_bytes());
    bytes.extend(1_u16.to_le_bytes());
    bytes.extend(RATE.to_le_bytes());
    bytes.extend((4 * RATE).to_le_bytes());
    bytes.extend(4_u16.to_le_bytes());
    bytes.extend(32_u16.to_le_bytes());
    bytes.extend(b"data");
    bytes.extend(size.to_le_bytes());
    bytes.extend(data);
    bytes
}

/// Imports a checkpoint with its anchors.
fn import(name: &str, scene: &str) {
    succeeds(&["import", &checkpoint(name), "--anchors", &checkpoint("anchors.safetensors"), "-o", scene]);
}

#[test]
fn a_checkpoint_becomes_a_scene_that_is_rendered() {
    let place = Place::new();
    let imported = place.text("imported.promenade");
    import("simple_sh.safetensors", &imported);
    let (text, _) = succeeds(&["inspect", &imported]);
    assert!(text.contains("simple-sh, 4 anchors") && text.contains("conv off"), "{text}");

    let (scene, baked, dry) = (place.text("cloud.promenade"), place.text("baked.promenade"), place.text("dry.wav"));
    std::fs::write(&scene, small_cloud().to_bytes().unwrap()).unwrap();
    let (_, said) = succeeds(&["bake", "field", &scene, "-o", &baked, "--pitch", "0,0", "--roll", "0,0", "--max-mb", "0.3"]);
    assert!(said.contains("dB in the median") && said.contains("kB"), "{said}");
    let json = json(&["inspect", &baked, "--json"]);
    assert!(json["field"]["memory_bytes"].as_u64().unwrap() <= 300_000, "{json}");

    // At another rate than the model's, so that clips convert.
    wav::write(Path::new(&dry), RATE, &[&noise(1, RATE as usize)], Format::Float32).unwrap();
    let render = |name: &str, options: &[&str]| {
        let out = place.text(name);
        succeeds(&[&["render", &baked, &dry, &out, "--bits", "32f"], options].concat());
        let wet = sound::read(Path::new(&out)).unwrap();
        assert!(wet.sample_rate_hz == RATE && wet.channels.len() == 2, "{name}");
        assert!(wet.frames() >= RATE as usize, "{name}: {} frames", wet.frames());
        rms(&wet.channels[0][..RATE as usize])
    };
    let levels = [render("stream.wav", &[]), render("clips.wav", &["--clips"])];
    assert!(levels.iter().all(|l| *l > 1e-3), "{levels:?}");
    assert!((levels[0] / levels[1]).log10().abs() < 0.3, "stream and clips are the same head: {levels:?}");
    let twice = place.text("twice.wav");
    render("twice.wav", &[]);
    assert!(std::fs::read(&twice).unwrap() == std::fs::read(place.path("stream.wav")).unwrap(), "two renders differ");

    let room = place.bake();
    all_fail(&[
        (vec!["render", &room, &dry, &twice, "--clips"], "anchor cloud"),
        (vec!["render", &baked, &dry, &twice, "--decay", "2"], "knows no parts"),
        (vec!["render", &baked, &dry, &twice, "--clips", "--low-cut", "80"], "knows no parts"),
        (vec!["bake", "field", &room, "-o", &baked], "anchor cloud"),
        (vec!["import", &dry, "-o", &imported], "dry.wav"),
        (vec!["import", &checkpoint("simple_sh.safetensors"), "-o", &imported], "the scene's anchors"),
    ]);
}

#[test]
fn measure_says_what_it_needs() {
    let place = Place::new();
    let (bare, cloud) = (place.text("bare.promenade"), place.text("cloud.promenade"));
    succeeds(&["bake", "responses", place.folder.path().to_str().unwrap(), "-o", &bare]);
    std::fs::write(&cloud, small_cloud().to_bytes().unwrap()).unwrap();
    let neither = "expected held-out measurements (bake it with --hold-out) or --trade, found neither";
    all_fail(&[(vec!["measure", &bare], neither), (vec!["measure", &cloud], neither)]);
}

/// A scene with a small anchor cloud whose weights look random.
pub(crate) fn small_cloud() -> Scene {
    let sizes = Sizes { anchors: 4, bands: 33, frames: 60, width: 32, hyper: 0 };
    let mut parts = clouds::parts(CloudKind::SimpleSh, sizes);
    // Masks near 1 are heard.
    for name in ["mix_prj.weight", "out.4.weight", "out.4.bias"] {
        parts.weights.get_mut(name).unwrap().values.iter_mut().for_each(|v| *v *= 0.1);
    }
    parts.weights.get_mut("mix_prj.bias").unwrap().values.fill(1.0);
    let model = CloudModel::new(parts).unwrap();
    let grid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 15 };
    let options = CloudSceneOptions {
        provenance: Provenance::default(),
        bounds: None,
        start_pose: None,
        taps: 16,
        conv: ConvMode::LookAhead,
        projection: Projection::Diagonal,
        seed: 1,
    };
    cloud_scene(Imported { model, grid, notes: Vec::new() }, options).unwrap()
}

#[test]
fn names_become_a_manifest_and_ambisonics_become_ears() {
    use promenade_baker::wav::{Format, write};
    let place = Place::new();
    let names = place.path("names");
    std::fs::create_dir(&names).unwrap();
    for (name, left) in [("azi_60.wav", 1.0_f32), ("azi_300.wav", 0.4)] {
        write(&names.join(name), RATE, &[&[0.0, left], &[0.0, 1.4 - left]], Format::Float32).unwrap();
    }
    let folder = names.to_str().unwrap();
    let said = fails(&["bake", "responses", folder, "-o", &place.text("none")]);
    assert!(said.contains("promenade responses manifest writes one"), "{said}");
    assert!(fails(&["responses", "manifest", folder]).contains("expected distances in the names"));
    let (_, said) = succeeds(&["responses", "manifest", folder, "--distance", "2"]);
    assert!(said.contains("responses.json: 2 responses at 16000 Hz"), "{said}");
    assert!(fails(&["responses", "manifest", folder]).contains("expected no responses.json"));

    // A plane wave from the left.
    let pulse = |gain: f32| (0..800).map(|i| if i == 40 { gain } else { 0.0 }).collect::<Vec<f32>>();
    let [w, y, silent] = [pulse(1.0), pulse(1.0), pulse(0.0)];
    write(&place.path("left.wav"), RATE, &[&w, &y, &silent, &silent], Format::Float32).unwrap();
    let (input, head, out) = (place.text("left.wav"), place.text(""), place.text("ears"));
    let args = ["responses", "ambisonic", &input, "--hrtf", &head, "-o", &out, "--yaws", "4"];
    assert!(fails(&args).contains("left.wav: left: expected a source, or a distance to it above 0, found neither"));
    let (_, said) = succeeds(&[&args[..], &["--distance", "2"]].concat());
    assert!(
        said.contains("its direct sound comes from: [0.00, 1.00, 0.00]") && said.contains("4 responses of 1 places"),
        "{said}"
    );
    let set = promenade_baker::Responses::load(place.path("ears").as_path(), &promenade_baker::LoadOptions::default()).unwrap();
    assert!(set.responses.iter().all(|r| (r.source.y - 2.0).abs() < 0.01) && set.responses.len() == 4);
    succeeds(&["bake", "responses", &out, "-o", &place.text("ears.promenade")]);
}

#[test]
fn nothing_is_written_over_what_is_read_or_under_the_name_of_another_kind() {
    let place = Place::new();
    let (scene, dry) = (place.bake(), place.dry("dry.wav", 0.2, 1));
    let (other, sounds, engine) = (place.text("room.wav"), place.text("dry.mp3"), place.text("engine.wasm"));
    std::fs::write(&engine, b"\0asm\x01\0\0\0").unwrap();
    let site = place.text("site");
    std::fs::create_dir(&site).unwrap();
    std::fs::write(place.text("site/index.html"), "<h1>My own page</h1>").unwrap();
    all_fail(&[
        (vec!["render", &scene, &dry, &scene], "expected a name that ends in .wav"),
        (vec!["render", &scene, &dry, &sounds], "dry.mp3: expected a name that ends in .wav"),
        (vec!["bake", "less", &scene, "-o", &scene, "--within", "1"], "a file that is not read as well"),
        (vec!["bake", "less", &scene, "-o", &other, "--within", "1"], "room.wav: expected a name that ends in .promenade"),
        (vec!["web", &scene, "--engine", &engine, "-o", &site], "expected a folder without a page, or with one of Promenade"),
    ]);
    assert_eq!(std::fs::read_to_string(place.text("site/index.html")).unwrap(), "<h1>My own page</h1>");
}
