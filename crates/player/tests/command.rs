//! The program from outside. What `promenade render` shares with it is tested there.

use super::common::{player, scene, succeeds};
use promenade_audio::sound;
use promenade_audio::wav::{self, Format};
use promenade_testing::heads::write_sofa;
use promenade_testing::signal::{noise, rms};
use std::path::Path;

/// Samples per second of what is played.
const RATE: u32 = 16_000;

/// A folder with a dry sound of 0.2 s, `dry.wav`.
fn place() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    wav::write(&folder.path().join("dry.wav"), RATE, &[&noise(1, 3200)], Format::Float32).unwrap();
    folder
}

fn text(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_file_is_played_into_a_folder_that_is_made_for_it() {
    let folder = place();
    let (scene, dry, head) = (scene("iosr-room-a.promenade"), text(&folder, "dry.wav"), text(&folder, "head.sofa"));
    write_sofa(Path::new(&head), 0.12);
    let play = |name: &str, more: &[&str]| {
        let out = text(&folder, name);
        let (_, said) = succeeds(&[&[&scene, &dry, &out, "--bits", "32f"], more].concat());
        assert!(said.contains("times real time"), "{said}");
        sound::read(Path::new(&out)).unwrap()
    };
    let plain = play("new/deep/plain.wav", &[]);
    assert!(plain.sample_rate_hz == RATE && plain.frames() > 3200 && plain.channels.len() == 2);
    assert!(plain.channels.iter().all(|ear| rms(ear) > 1e-3));
    for more in [&["--head", &head][..], &["--pose", "0,0,0,90,0,0"], &["--gain", "-6"]] {
        assert_ne!(play("other.wav", more).channels, plain.channels, "{more:?}");
    }
}

#[test]
fn what_is_read_is_not_written_over() {
    let folder = place();
    let (scene, dry) = (scene("iosr-room-a.promenade"), text(&folder, "dry.wav"));
    let before = std::fs::read(&dry).unwrap();
    let roundabout = text(&folder, "../") + folder.path().file_name().unwrap().to_str().unwrap() + "/dry.wav";
    for args in [vec![&scene, &dry, &dry], vec![&scene, &dry, &roundabout]] {
        let args: Vec<&str> = args.into_iter().map(String::as_str).collect();
        let out = player(&args);
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!((out.status.code(), said.lines().count()), (Some(1), 1), "{said}");
        assert!(said.starts_with("error: ") && said.contains("expected the name of a file that is not read as well"), "{said}");
    }
    assert_eq!(std::fs::read(&dry).unwrap(), before);
}

#[test]
fn failures_are_one_line_and_leave_nothing() {
    let folder = place();
    let (room, dry, out) = (scene("iosr-room-a.promenade"), text(&folder, "dry.wav"), text(&folder, "new/out.wav"));
    for (args, clue) in [
        (vec!["none.promenade", &dry, &out], "none.promenade: cannot be read: "),
        (
            vec![&dry, &dry, &out],
            "dry.wav: expected a scene, which is the first file and ends in .promenade, found a file that ends in .wav",
        ),
        (vec![&room, "none.wav", &out], "none.wav: cannot be read: "),
        (vec![&room, &dry, &out, "--path", "none.json"], "none.json: cannot be read: "),
        (vec![&room, &dry, &out, "--clips"], "anchor cloud"),
        (vec![&room, &dry, &out, "--emitter", "1,2,3"], "expected a scene that was trained with several emitters"),
        (vec![&room, &dry, &out, "--format", "ambix", "--headphones", "a"], "ambix, which has no ears"),
        (vec![&room, &dry, &out, "--stereo-spread", "30"], "expected 2 channels for --stereo-spread, found 1"),
    ] {
        let said = player(&args);
        let (code, said) = (said.status.code(), String::from_utf8(said.stderr).unwrap());
        assert_eq!((code, said.lines().count()), (Some(1), 1), "{args:?}: {said}");
        assert!(said.starts_with("error: ") && said.contains(clue), "{args:?}: {said}");
        assert!(!folder.path().join("new").exists(), "{args:?}");
    }
}

#[test]
fn help_is_one_screen_and_what_is_not_understood_is_status_2() {
    let (help, said) = succeeds(&["--help"]);
    assert!(said.is_empty() && help.starts_with("promenade-player SCENE DRY -o OUT"), "{help}");
    assert!(help.lines().count() <= 40 && help.lines().all(|line| line.chars().count() <= 100), "{help}");
    for args in [&[][..], &["a", "b"], &["a", "b", "c", "--mix", "2"], &["a", "b", "c", "--verbose"]] {
        let out = player(args);
        let said = String::from_utf8(out.stderr).unwrap();
        assert_eq!((out.status.code(), said.lines().count()), (Some(2), 1), "{args:?}: {said}");
        assert!(said.starts_with("error: ") && said.ends_with("promenade-player --help lists all options\n"), "{said}");
    }
}

/// An option that help does not name, or one that it names and nobody takes, would be found by chance only.
#[test]
fn help_names_the_options_that_there_are() {
    let (help, _) = succeeds(&["--help"]);
    let named: Vec<&str> = help.split([' ', ',', '\n']).filter(|word| word.starts_with("--")).collect();
    assert!(named.len() > 20, "{named:?}");
    for name in named {
        let out = player(&["a", "b", "c", name]);
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(!said.contains("an option that there is"), "{said}");
    }
    let taken = include_str!("../src/command/options.rs")
        .lines()
        .filter_map(|line| line.trim().strip_prefix('"')?.split_once("\" => "));
    let taken: Vec<&str> =
        taken.map(|(names, _)| names.split('"').next().unwrap()).filter(|name| !["binaural", "ambix"].contains(name)).collect();
    assert!(taken.len() > 20, "{taken:?}");
    for name in taken {
        assert!(help.contains(&format!("--{name}")), "--{name} is not in the help");
    }
}
