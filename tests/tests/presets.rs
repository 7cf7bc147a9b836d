//! What a host's browser gets of the built plugin, and what it loads: each test in a process with a home and a library of its
//! own.

use promenade_host::{Preset, PresetPlace};
use promenade_tests::listener::{POSE, choose, pose_of};
use promenade_tests::signal::{difference_db, noise};
use promenade_tests::{ClapHost, Host, Setup, Vst3, in_both_formats, in_library, render};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

in_both_formats!(a_preset_keeps_its_pose_where_the_host_had_chosen_a_scene, a_preset_without_its_place_is_as_loud);

const PRESETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../presets");

/// The library, a copy of each factory preset where VST3 hosts look, and one of the user's.
fn fill(home: &Path) {
    for (from, name) in files(&Path::new(PRESETS).join("library"), "promenade") {
        fs::copy(from, home.join(name).with_extension("promenade")).unwrap();
    }
    let folder = users(home);
    fs::create_dir_all(&folder).unwrap();
    for (from, name) in files(&Path::new(PRESETS).join("plugin"), "vstpreset") {
        fs::copy(from, folder.join(name + ".vstpreset")).unwrap();
    }
    fs::copy(folder.join("Office, at the door.vstpreset"), folder.join("Mine.vstpreset")).unwrap();
    fs::write(folder.join("Torn.vstpreset"), b"VST3").unwrap();
}

fn users(home: &Path) -> PathBuf {
    home.join(".vst3/presets/Promenade/Promenade")
}

/// Paths and names of the files with an extension, by name.
fn files(folder: &Path, extension: &str) -> Vec<(PathBuf, String)> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .map(|path| (path.clone(), path.file_stem().unwrap().to_str().unwrap().to_owned()))
        .collect();
    all.sort();
    all
}

/// What the browser is told.
fn listed<H: Host>() -> Vec<Preset> {
    let bundle = H::bundle();
    let (presets, wrong) = bundle.presets(&bundle.plugins()[0]).unwrap();
    assert!(wrong.is_empty(), "{wrong:?}");
    presets
}

fn named(presets: &[Preset], name: &str) -> Preset {
    presets.iter().find(|preset| preset.name == name).unwrap_or_else(|| panic!("no {name:?}")).clone()
}

fn field(state: &Value, name: &str) -> Value {
    serde_json::from_str(state["fields"][name].as_str().unwrap()).unwrap()
}

#[test]
fn a_clap_browser_gets_presets_by_use_and_the_scenes_of_the_library() {
    in_library(fill, |home| {
        let presets = listed::<ClapHost>();
        let within = |folder: &str| presets.iter().filter(|preset| preset.folder == folder).collect::<Vec<_>>();
        let expected: Vec<_> =
            files(&Path::new(PRESETS).join("plugin"), "vstpreset").into_iter().map(|(_, name)| name).collect();
        let factory = within("Factory");
        assert!(factory.iter().map(|preset| &preset.name).eq(&expected), "{factory:#?}");
        assert!(expected.len() >= 12);
        for preset in &factory {
            assert!(preset.is_factory && preset.place == PresetPlace::Plugin && preset.creators == ["Promenade"], "{preset:?}");
            assert!(preset.description.ends_with('.') && !preset.features.is_empty(), "{preset:?}");
        }
        assert_eq!(named(&presets, "Corridor, walk to the source").features, ["walk", "film"]);
        // Copies that were installed for VST3 hosts are not listed again; what cannot be read is, and says so when it is
        // loaded.
        let own = within("User presets");
        assert_eq!(own.iter().map(|preset| &preset.name[..]).collect::<Vec<_>>(), ["Mine", "Torn"]);
        assert_eq!(own[0].place, PresetPlace::File(users(home).join("Mine.vstpreset")));
        // The home is the library here, so that its presets are found in it as well.
        let is_scene = |preset: &&&Preset| matches!(&preset.place, PresetPlace::File(path) if path.parent() == Some(home));
        let library = within("Scene library");
        assert_eq!(library.iter().filter(is_scene).count(), files(home, "promenade").len());
        let hall = named(&presets, "Concert hall, 42 x 21 x 16 m");
        assert_eq!((hall.features, hall.is_factory), (vec!["scene".to_owned()], false));
        assert_eq!(presets.len(), factory.len() + own.len() + library.len());
    });
}

#[test]
fn a_vst3_browser_finds_the_installed_presets() {
    in_library(fill, |home| {
        let presets = listed::<Vst3>();
        assert_eq!(presets.len(), files(&users(home), "vstpreset").len());
        assert_eq!(named(&presets, "Mine").folder, users(home).display().to_string());
    });
}

#[test]
fn a_preset_that_a_clap_browser_loads_sounds_as_the_file_does() {
    in_library(fill, |home| {
        let presets = listed::<ClapHost>();
        let signal = noise(12_000);
        for name in ["Half dry, source on the left", "Concert hall, tenth row"] {
            let mut clap = ClapHost::open(Setup::default());
            let dry = render(&mut clap, &[&signal, &signal], &[512]);
            clap.instance().load_preset(&named(&presets, name)).unwrap();
            clap.reopen(Setup::default());
            let heard = render(&mut clap, &[&signal, &signal], &[512]);
            let mut vst3 = Vst3::open(Setup::default());
            vst3.instance().load_file(&users(home).join(format!("{name}.vstpreset"))).unwrap();
            vst3.reopen(Setup::default());
            let expected = render(&mut vst3, &[&signal, &signal], &[512]);
            let (same, changed) = (difference_db(&heard, &expected), difference_db(&heard, &dry));
            assert!(same < -100.0 && changed > -20.0, "{name}: {same} dB from the file, {changed} dB from before");
        }
    });
}

#[test]
fn a_preset_sets_what_presets_set_and_leaves_the_rest() {
    in_library(fill, |home| {
        let presets = listed::<ClapHost>();
        let mut host = ClapHost::open(Setup::default());
        for (id, value) in [("mix", 0.25), ("osc", 1.0), ("yaw", 0.9)] {
            host.set(id, value);
        }
        host.process(&[&[0.0; 64], &[0.0; 64]]);
        host.instance().load_preset(&named(&presets, "Mine")).unwrap();
        let state = host.state();
        assert_eq!((&state["params"]["yaw"]["f32"], &state["params"]["mix"]["f32"]), (&json!(20.0), &json!(1.0)));
        assert_eq!(state["params"]["osc"]["bool"], json!(true), "a preset opens and closes no port");

        // A scene is played from where its makers let the listener begin, and is the project's own from then on.
        host.set("mix", 0.25);
        host.process(&[&[0.0; 64], &[0.0; 64]]);
        host.instance().load_preset(&named(&presets, "Concert hall, 42 x 21 x 16 m")).unwrap();
        let state = host.state();
        let key = field(&state, "scene");
        assert_eq!(key["absolute"], json!(home.join("concert-hall.promenade")));
        assert_eq!(key["hash"].as_str().map(str::len), Some(64));
        assert_eq!((&state["params"]["scene"]["string"], &state["params"]["slot"]["i32"]), (&json!("library"), &json!(0)));
        assert_eq!((&state["params"]["x"]["f32"], &state["params"]["mix"]["f32"]), (&json!(21.0), &json!(0.25)));
    });
}

#[test]
fn a_preset_that_cannot_be_loaded_says_why_and_changes_nothing() {
    in_library(fill, |home| {
        let presets = listed::<ClapHost>();
        let mut host = ClapHost::open(Setup::default());
        let before = host.save();
        let torn = named(&presets, "Torn");
        let missing = Preset { place: PresetPlace::File(home.join("none.vstpreset")), ..torn.clone() };
        let scene = Preset { place: PresetPlace::File(home.join("none.promenade")), ..torn.clone() };
        let unknown = Preset { place: PresetPlace::Plugin, key: Some("No such preset".to_owned()), ..torn.clone() };
        for (preset, said) in [
            (torn, "Torn.vstpreset: expected a preset of Promenade, found a preset of another plugin"),
            (missing, "none.vstpreset"),
            (scene, "none.promenade"),
            (unknown, "No such preset: expected a preset of Promenade, found no factory preset of that name"),
        ] {
            let error = host.instance().load_preset(&preset).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
        assert_eq!(host.save(), before);
        let found = ClapHost::bundle().preset(&ClapHost::bundle().plugins()[0], "office, at the DOOR").unwrap_err().to_string();
        assert!(found.contains("did you mean \"Office, at the door\"?"), "{found}");
    });
}

/// A preset in Steinberg's format, of a state as JSON: head, state, and a list of the one chunk.
fn preset(like: &[u8], state: &Value) -> Vec<u8> {
    const HEAD: usize = 48;
    let state = state.to_string();
    let list = u64::try_from(HEAD + state.len()).unwrap();
    let mut bytes = [&like[..40], &list.to_le_bytes(), state.as_bytes(), b"List", &1_u32.to_le_bytes(), b"Comp"].concat();
    bytes.extend(u64::try_from(HEAD).unwrap().to_le_bytes());
    bytes.extend(u64::try_from(state.len()).unwrap().to_le_bytes());
    bytes
}

/// As where only the plugin's file was copied. The dry studio is built in.
fn a_preset_without_its_place_is_as_loud<H: Host>() {
    in_library(
        |_| (),
        |_| {
            let signal = noise(24_000);
            let energy = |sound: &[f32]| sound.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
            for (name, level_db) in
                [("Club, at the bar", -9.2), ("Stairwell, behind you", -3.0), ("Cathedral, in the nave", -12.1)]
            {
                let mut host = H::open(Setup::default());
                let place = PresetPlace::File(Path::new(PRESETS).join("plugin").join(format!("{name}.vstpreset")));
                host.instance().load_preset(&Preset { place, ..unnamed() }).unwrap();
                host.instance().settle().unwrap();
                let [left, right] = render(&mut host, &[&signal, &signal], &[512]);
                let heard_db = 10.0 * (0.5 * (energy(&left) + energy(&right)) / energy(&signal)).log10();
                assert!(
                    (heard_db - level_db).abs() < 0.5,
                    "{name} plays {heard_db:.1} dB over the dry track, {level_db} expected"
                );
            }
            let mut host = H::open(Setup::default());
            let place = PresetPlace::File(Path::new(PRESETS).join("plugin/Dry studio, beside the player.vstpreset"));
            host.instance().load_preset(&Preset { place, ..unnamed() }).unwrap();
            host.instance().settle().unwrap();
            let [left, right] = render(&mut host, &[&signal, &signal], &[512]);
            assert!(difference_db(&[left.clone(), left.clone()], &[left, right]) > -20.0, "both ears hear the dry track");
        },
    );
}

fn unnamed() -> Preset {
    let (name, folder, description) = Default::default();
    let (key, features, creators) = Default::default();
    Preset { name, place: PresetPlace::Plugin, key, folder, description, features, creators, is_factory: false }
}

/// The host chooses a scene, whose listener goes to where it begins; a preset puts him elsewhere in another scene, be it where
/// a listener is whom nobody has put anywhere.
fn a_preset_keeps_its_pose_where_the_host_had_chosen_a_scene<H: Host>() {
    in_library(fill, |home| {
        let listed: Vec<_> = files(home, "promenade").into_iter().map(|(_, name)| name).collect();
        let corridor = 1 + listed.iter().position(|name| name == "corridor").unwrap();
        let like = fs::read(users(home).join("Club, at the bar.vstpreset")).unwrap();
        let start = like.windows(10).position(|w| w == b"{\"version\"").unwrap();
        let mut club: Value = serde_json::Deserializer::from_slice(&like[start..]).into_iter().next().unwrap().unwrap();
        for (name, pose) in [("bar", [2.0, 2.0, 1.5, -53.7, 0.0, 0.0]), ("origin", [0.0; 6])] {
            for (id, value) in POSE.into_iter().zip(pose) {
                club["params"][id] = json!({ "f32": value });
            }
            let file = home.join(name).with_extension("vstpreset");
            fs::write(&file, preset(&like, &club)).unwrap();
            let mut host = H::open(Setup::default());
            choose(&mut host, u8::try_from(corridor).unwrap());
            assert!(pose_of(&mut host).iter().any(|value| value.abs() > 1.0), "the corridor begins at the origin");
            let place = PresetPlace::File(file);
            let known = Preset { place, ..unnamed() };
            host.instance().load_preset(&known).unwrap();
            // Whatever is read in the background has been read by then.
            host.instance().settle().unwrap();
            host.process(&[&[0.0; 64], &[0.0; 64]]);
            let title = field(&host.state(), "scene")["title"].as_str().unwrap_or_default().to_owned();
            assert!(title.starts_with("Club"), "{name}: {title}");
            let is = pose_of(&mut host);
            assert!(is.iter().zip(&pose).all(|(is, was)| (is - was).abs() < 2e-3), "{name}: {is:?} for {pose:?}");
        }
    });
}
