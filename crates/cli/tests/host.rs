//! `promenade host` from outside, with the plugin of this workspace in both formats.

use crate::common::{fails, json as reported, promenade, succeeds};
use promenade_baker::sound;
use promenade_baker::wav::{self, Format};
use promenade_tests::signal::{difference_db, first_difference, noise, peak};
use promenade_tests::{Host, Setup, bundle, edit_state, in_both_formats};
use serde_json::json;
use std::path::{Path, PathBuf};

in_both_formats!(
    lists_the_parameters,
    a_preset_is_found_by_its_name,
    a_pose_sounds_as_it_is_rendered,
    a_camera_path_along_the_transport_sounds_as_it_is_rendered,
    automation_is_on_its_sample,
    the_documented_automation_is_played,
    another_rate_is_converted_to,
    further_tracks_come_from_their_places,
    what_is_wrong_is_said_in_one_line,
);

const RATE: u32 = 48_000;
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/loft.promenade");

/// A folder with the plugin under a name that tells its format.
struct Place {
    folder: tempfile::TempDir,
    plugin: String,
}

impl Place {
    fn new<H: Host>() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let plugin = match H::FORMAT {
            promenade_tests::Format::Clap => {
                let named = folder.path().join("Promenade.clap");
                std::fs::copy(bundle::clap(), &named).unwrap();
                named
            }
            promenade_tests::Format::Vst3 => bundle::vst3(),
        };
        Self { plugin: plugin.to_str().unwrap().to_owned(), folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn dry(&self, channels: &[&[f32]]) -> String {
        wav::write(&self.path("dry.wav"), RATE, channels, Format::Float32).unwrap();
        self.text("dry.wav")
    }

    /// The two ears of a file.
    fn heard(&self, name: &str) -> [Vec<f32>; 2] {
        sound::read(&self.path(name)).unwrap().channels.try_into().unwrap()
    }

    fn host(&self, input: &str, options: &[&str]) -> [Vec<f32>; 2] {
        let out = self.text("host.wav");
        succeeds(&[&["host", &self.plugin, input, &out], options].concat());
        self.heard("host.wav")
    }

    /// The rendering of the scene that a new instance plays, as long as that of the host.
    fn render(&self, input: &str, len: usize, options: &[&str]) -> [Vec<f32>; 2] {
        let out = self.text("render.wav");
        succeeds(&[&["render", SCENE, input, &out, "--bits", "32f"], options].concat());
        self.heard("render.wav").map(|ear| ear[..len].to_vec())
    }
}

fn lists_the_parameters<H: Host>() {
    let place = Place::new::<H>();
    let (text, _) = succeeds(&["host", &place.plugin, "--list", "--set", "Yaw=-30"]);
    assert!(text.starts_with(&format!("Promenade {} ({})", env!("CARGO_PKG_VERSION"), H::FORMAT)), "{text}");
    assert!(text.contains("latency 780 samples at 48000 Hz, 16.25 ms"), "{text}");
    let row = |name: &str| {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{name} in {text}"));
        line.split_whitespace().skip(1).map(str::to_owned).collect::<Vec<_>>()
    };
    // VST3's units are not asked for.
    let (pose, sound): (&[&str], &[&str]) =
        if H::FORMAT == promenade_tests::Format::Clap { (&["Pose"], &["Sound"]) } else { (&[], &[]) };
    assert_eq!(row("Yaw"), [&["119407", "0.00", "deg", "-30.00", "deg", "-", "yes"], pose].concat());
    assert_eq!(&row("Accuracy")[1..], [&["All", "All", "4", "yes"], sound].concat());
    assert_eq!(text.contains("page Listener / Pose: Listener X"), H::FORMAT == promenade_tests::Format::Clap, "{text}");
}

fn a_preset_is_found_by_its_name<H: Host>() {
    let place = Place::new::<H>();
    let (text, _) = succeeds(&["host", &place.plugin, "--presets"]);
    assert!(text.starts_with(&format!("Promenade ({}): ", H::FORMAT)), "{text}");
    let input = place.dry(&[&noise(12_000)]);
    let failed = fails(&["host", &place.plugin, &input, &place.text("out.wav"), "--preset", "Best"]);
    assert!(failed.contains("presets, found \"Best\""), "{failed}");
    // Those of VST3 plugins are where they are installed.
    if H::FORMAT == promenade_tests::Format::Clap {
        let name = "Half dry, source on the left";
        assert!(text.contains("\nFactory\n"), "{text}");
        let row = text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{text}"));
        assert!(["(music)", "60 degrees to the left"].iter().all(|words| row.contains(words)), "{row}");
        let heard = place.host(&input, &["--preset", name]);
        let set = place.host(&input, &["--set", "Scene=IoSR room A", "--set", "Yaw=-60 deg", "--set", "Dry/Wet=50 %"]);
        assert!(difference_db(&heard, &set) < -120.0 && peak(&heard[0]) > 0.05);
    }
}

fn a_pose_sounds_as_it_is_rendered<H: Host>() {
    let place = Place::new::<H>();
    let (left, right) = (noise(30_000), noise(30_001)[1..].to_vec());
    for channels in [&[&left[..]][..], &[&left, &right]] {
        let input = place.dry(channels);
        let heard = place.host(&input, &["--set", "Yaw=30 deg", "--set", "Listener X=0.5", "--tail", "0.1"]);
        assert_eq!(heard[0].len(), 30_000 + 4_800);
        let rendered = place.render(&input, heard[0].len(), &["--pose", "0.5,0,0,30,0,0"]);
        assert!(peak(&rendered[0]) > 0.05);
        let difference = difference_db(&heard, &rendered);
        assert!(difference < -120.0, "{difference} dB");
        let elsewhere = place.render(&input, heard[0].len(), &["--pose", "0.5,0,0,31,0,0"]);
        assert!(difference_db(&heard, &elsewhere) > -60.0, "a degree makes no difference");
    }
}

fn a_camera_path_along_the_transport_sounds_as_it_is_rendered<H: Host>() {
    let place = Place::new::<H>();
    let input = place.dry(&[&noise(48_000)]);
    let keyframes = json!([
        { "t": 0.0, "position": [0.0, 0.0, 0.0], "ypr": [-60.0, 0.0, 0.0] },
        { "t": 0.7, "position": [0.5, 0.3, 0.0], "ypr": [60.0, 10.0, 0.0] },
    ]);
    std::fs::write(place.path("walk.json"), keyframes.to_string()).unwrap();
    let mut plugin = H::open(Setup::default());
    let mut state = plugin.state();
    state["params"]["follow"] = json!({ "string": "transport" });
    assert!(plugin.load(&edit_state(&state, "walk", &json!({ "keyframes": keyframes }))));
    std::fs::write(place.path("walking.state"), plugin.instance().save().unwrap()).unwrap();

    let heard = place.host(&input, &["--state", &place.text("walking.state"), "--block", "1000"]);
    let rendered = place.render(&input, heard[0].len(), &["--path", &place.text("walk.json")]);
    // Delays of image sources show the last digits of a pose, which the host's clock decides.
    let difference = difference_db(&heard, &rendered);
    assert!(difference < -100.0, "{difference} dB");
    // Saved and restored once more, and told of real time.
    let options = ["--state", &place.text("walking.state"), "--save-state", &place.text("again.state"), "--realtime"];
    assert!(difference_db(&place.host(&input, &options), &heard) < -100.0);
    assert!(difference_db(&place.host(&input, &["--state", &place.text("again.state")]), &heard) < -100.0);
}

fn automation_is_on_its_sample<H: Host>() {
    let place = Place::new::<H>();
    let input = place.dry(&[&noise(24_000)]);
    let play = |text: &str| {
        std::fs::write(place.path("moves.json"), text).unwrap();
        place.host(&input, &["--automation", &place.text("moves.json"), "--set", "Dry/Wet=0"])
    };
    let steady = play(r#"{"parameters": {}}"#);
    assert!(steady[0].iter().zip(noise(24_000)).all(|(a, b)| (a - b).abs() < 1e-6), "the dry sound is out of time");
    // By name and by number, and as a text, a number and a share of the range.
    for (name, value) in [("Output Gain", "\"-6 dB\""), ("3165055", "-6"), ("Output Gain", "{\"normalized\": 0.75}")] {
        let text = format!(
            r#"{{"parameters": {{"{name}": [{{"t": 0, "value": 0, "hold": true}}, {{"t": 0.2501, "value": {value}}}]}}}}"#
        );
        let stepped = play(&text);
        assert_eq!(first_difference(&steady, &stepped), Some(12_005), "{text}");
        let ratio = stepped[0][20_000] / steady[0][20_000];
        assert!((ratio - 10_f32.powf(-6.0 / 20.0)).abs() < 1e-4, "{text}: {ratio}");
    }
    // Half way up the ramp it is half way.
    let ramp = play(r#"{"parameters": {"Output Gain": [{"t": 0.1, "value": 0}, {"t": 0.3, "value": -12}]}}"#);
    assert_eq!(first_difference(&steady, &ramp), Some(4_800 + 32));
    let level_db = 20.0 * (ramp[0][9_600] / steady[0][9_600]).log10();
    assert!((level_db + 6.0).abs() < 0.1, "{level_db} dB");
}

fn the_documented_automation_is_played<H: Host>() {
    let place = Place::new::<H>();
    let input = place.dry(&[&noise(60_000)]);
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/hosts.md")).unwrap();
    let example = page.split("```json").nth(1).and_then(|rest| rest.split("```").next()).expect("the page has an example");
    std::fs::write(place.path("moves.json"), example).unwrap();
    let moved = place.host(&input, &["--automation", &place.text("moves.json")]);
    // At the start it is a pose; then the head turns, the gain falls and the dry sound comes in.
    let still = place.render(&input, moved[0].len(), &["--pose", "0,0,0,-60,0,0"]);
    let part = |ears: &[Vec<f32>; 2], from: usize| [0, 1].map(|ear| ears[ear][from..from + 200].to_vec());
    // The head has begun to turn by the first frame, which is heard most in the phase that holds above the data's highest
    // frequency.
    let (first, later) =
        (difference_db(&part(&moved, 0), &part(&still, 0)), difference_db(&part(&moved, 50_000), &part(&still, 50_000)));
    assert!(first < -15.0 && first < later - 15.0, "{first} dB at the start, {later} dB later");
}

fn another_rate_is_converted_to<H: Host>() {
    let place = Place::new::<H>();
    let tone: Vec<f32> = (0..24_000).map(|i| 0.5 * (i as f32 * 0.05).sin()).collect();
    let input = place.dry(&[&tone]);
    let out = place.text("host.wav");
    succeeds(&["host", &place.plugin, &input, &out, "--rate", "44100", "--set", "Bypass=On"]);
    let wav = sound::read(Path::new(&out)).unwrap();
    assert_eq!((wav.sample_rate_hz, wav.frames()), (44_100, 22_050));
    let expected = |i: usize| 0.5 * (i as f32 * 0.05 * 48_000.0 / 44_100.0).sin();
    let error = (1_000..21_000).fold(0.0_f32, |most, i| most.max((wav.channels[0][i] - expected(i)).abs()));
    assert!(error < 1e-3, "{error}");
}

fn further_tracks_come_from_their_places<H: Host>() {
    let place = Place::new::<H>();
    let (first, second, third) = (noise(20_000), noise(24_000)[4_000..].to_vec(), noise(30_000)[6_000..].to_vec());
    let input = place.dry(&[&first]);
    let track = |name: &str, rate: u32, channels: &[&[f32]]| {
        wav::write(&place.path(name), rate, channels, Format::Float32).unwrap();
        place.text(name)
    };
    let (second, third) = (track("second.wav", RATE, &[&second]), track("third.wav", RATE, &[&third]));
    let placed = ["2 Offset X=0", "2 Offset Y=0.5", "3 Offset X=-1.5625", "3 Offset Y=-0.5"].map(|set| format!("Source {set}"));
    let sets = placed.iter().flat_map(|set| ["--set", set.as_str()]);
    let options: Vec<&str> =
        ["--plugin", "Promenade Many", "--track", &second, "--track", &third].into_iter().chain(sets).collect();
    let heard = place.host(&input, &options);
    assert_eq!(heard[0].len(), 24_000, "as long as the longest");
    // The emitter of this scene, and where the second and third source are beside it.
    let emitter = &reported(&["inspect", SCENE, "--json"])["emitter_m"];
    let [emitter_x, emitter_y, z] = [0, 1, 2].map(|axis| emitter[axis].as_f64().unwrap());
    let at = |x: f64, y: f64, sound: &str| format!("{},{},{z}={sound}", emitter_x + x, emitter_y + y);
    let places = ["--pose", "0,0,0,0,0,0", "--source", &at(0.0, 0.5, &second), "--source", &at(-1.5625, -0.5, &third)];
    let difference = difference_db(&heard, &place.render(&input, 24_000, &places));
    assert!(difference < -100.0, "{difference} dB");
    let alone = place.host(&input, &["--plugin", "Promenade Many"]);
    assert!(difference_db(&[0, 1].map(|ear| heard[ear][..20_000].to_vec()), &alone) > -20.0);
    let (text, _) = succeeds(&["host", &place.plugin, "--list", "--plugin", "Promenade Many 64"]);
    assert!(text.contains("\n63 inputs after the main one, for --track\n"), "{text}");

    // Another rate is converted, and what cannot be connected is told.
    let tone: Vec<f32> = (0..12_000).map(|i| 0.5 * (i as f32 * 0.05).sin()).collect();
    let slow = track("slow.wav", RATE / 2, &[&tone]);
    let bypassed = place.host(&input, &["--plugin", "Promenade Many", "--track", &slow, "--set", "Bypass=On"]);
    assert_eq!(bypassed[0].len(), 24_000);
    let error = (20_100..23_000).fold(0.0_f32, |most, i| most.max((bypassed[0][i] - 0.5 * (i as f32 * 0.025).sin()).abs()));
    assert!(error < 1e-3, "{error}");
    let stereo = track("stereo.wav", RATE, &[&tone, &tone]);
    let out = place.text("out.wav");
    let fails = |options: &[&str]| fails(&[&["host", &place.plugin, &input, &out], options].concat());
    let many = ["--plugin", "Promenade Many"];
    let sixteen = [&many[..], &["--track", &second].repeat(16)].concat();
    for (line, said) in [
        (fails(&["--track", &second]), "Promenade: expected an input after the main one, found 0"),
        (fails(&sixteen), "Promenade Many: expected 16 inputs after the main one, found 15"),
        (fails(&[&many[..], &["--track", &stereo]].concat()), "stereo.wav: expected a mono track, found 2 channels"),
        (fails(&[&many[..], &["--track", "none.wav"]].concat()), "none.wav"),
    ] {
        assert!(line.contains(said), "{line}");
    }
    assert!(!place.path("out.wav").exists());
}

fn what_is_wrong_is_said_in_one_line<H: Host>() {
    let place = Place::new::<H>();
    let input = place.dry(&[&noise(4_800)]);
    let (out, plugin) = (place.text("out.wav"), place.plugin.clone());
    let moves = |text: &str| {
        std::fs::write(place.path("moves.json"), text).unwrap();
        place.text("moves.json")
    };
    let fails = |options: &[&str]| {
        let line = crate::common::fails(&[&["host", &plugin, &input, &out], options].concat());
        assert!(!place.path("out.wav").exists(), "{options:?} leaves a file");
        line
    };
    let automated = |text: &str| fails(&["--automation", &moves(text)]);
    for (line, said) in [
        (fails(&["--set", "Jaw=3"]), "parameters, found \"Jaw\""),
        (fails(&["--set", "Accuracy=Best"]), "such as \"All\", found \"Best\""),
        (fails(&["--state", &input]), "dry.wav"),
        (fails(&["--plugin", "Other"]), "expected a plugin \"Other\", found Promenade"),
        (fails(&["--automation", "none.json"]), "none.json: cannot be read"),
        (automated("{"), "moves.json: expected {\"parameters\""),
        (
            automated(r#"{"parameters": {"Jaw": [{"t": 0, "value": 1}]}}"#),
            "moves.json: parameter \"Jaw\": Promenade: expected one",
        ),
        (automated(r#"{"parameters": {"Yaw": [{"t": 0, "value": "left"}]}}"#), "such as \"0.00 deg\", found \"left\""),
        (automated(r#"{"parameters": {"Yaw": [{"t": 0, "value": true}]}}"#), "found true"),
        (automated(r#"{"parameters": {"Yaw": []}}"#), "parameter \"Yaw\": expected at least one point"),
        (
            automated(r#"{"parameters": {"Yaw": [{"t": 1, "value": 0}, {"t": 0.5, "value": 0}]}}"#),
            "expected a time after 1 s at point 1, found 0.5 s",
        ),
        (
            automated(r#"{"parameters": {"Yaw": [{"t": 0, "value": 0}], "119407": [{"t": 0, "value": 0}]}}"#),
            "parameter \"119407\": expected each parameter once",
        ),
        (automated(r#"{"parameters": {"Revision": [{"t": 0, "value": 1}]}}"#), "may be automated"),
    ] {
        assert!(line.contains(said), "{line}");
    }
    assert_eq!(promenade(&["host", &plugin, &input]).status.code(), Some(2), "an output is missing");
    assert_eq!(promenade(&["host", &plugin, "--list", &input, &out]).status.code(), Some(2));
    let names: Vec<_> = std::fs::read_dir(place.folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(names.iter().all(|name| !name.to_string_lossy().contains("partial")), "{names:?}");
}
