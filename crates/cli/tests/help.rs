//! Help, completions, and what is said of what people type.

use crate::common::{Place, succeeds};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn help_is_in_groups_and_has_examples() {
    let (help, _) = succeeds(&["--help"]);
    let places: Vec<usize> = ["Hear:", "Make a room:", "Measure:", "Learn:", "Publish:", "Options:"]
        .map(|title| help.find(&format!("\n{title}\n")).unwrap_or_else(|| panic!("{title}: {help}")))
        .to_vec();
    assert!(places.is_sorted() && help.contains("\n  simulate     Make binaural"), "{help}");
    for command in ["simulate", "eval", "bake", "render"] {
        let (help, _) = succeeds(&[command, "--help"]);
        assert!(
            help.matches(&format!("\n  promenade {command}")).count() + help.matches("| promenade ").count() >= 2,
            "{help}"
        );
    }
}

#[test]
fn completions_and_pages_are_written() {
    let (bash, _) = succeeds(&["completions", "bash"]);
    assert!(bash.contains("--emitter") && bash.contains("--headphones"), "of render too");
    let folder = tempfile::tempdir().unwrap();
    succeeds(&["completions", "-o", folder.path().to_str().unwrap()]);
    let count = |name: &str| std::fs::read_dir(folder.path().join(name)).unwrap().count();
    assert_eq!(count("completions"), 5);
    let page = std::fs::read_to_string(folder.path().join("man/promenade-render.1")).unwrap();
    assert!(count("man") > 25 && page.contains("stereo\\-spread"), "{page}");
}

#[test]
fn a_pose_far_outside_of_the_scene_is_told() {
    let place = Place::new();
    let (scene, input, out) = (place.bake(), place.dry("in.wav", 0.2, 1), place.text("out.wav"));
    let said = |pose: &str| succeeds(&["render", &scene, &input, "-o", &out, "--pose", pose]).1;
    let far = said("40,0,0,0,0,0");
    assert!(far.contains("note: --pose: 40.0 m outside of the scene, known from"), "{far}");
    assert!(!said("0.5,0,0,0,0,0").contains("outside"), "near");
    std::fs::write(place.path("walk.csv"), "t,x,y,z,yaw,pitch,roll\n0,0,0,0,0,0,0\n1,0,-9,0,0,0,0\n").unwrap();
    let (_, said) = succeeds(&["render", &scene, &input, "-o", &out, "--path", &place.text("walk.csv")]);
    assert!(said.contains("note: --path: 9.0 m outside"), "{said}");
}

/// A log has a line every ten seconds, though the first stage of the work has nothing to show for itself.
#[test]
fn a_log_is_told_of_work_every_ten_seconds() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    crate::simulate::head(&folder.path().join("head"));
    let (ears, out) = (text("head"), text("out"));
    let room = ["simulate", "box", "--size", "7,5,3", "--emitter", "3,2,1.5", "--head", &ears, "-o", &out];
    let long = ["--rays", "20000000", "--length", "4", "--materials", "0.01", "--poses", "20"];
    let mut child =
        Command::new(env!("CARGO_BIN_EXE_promenade")).args([&room[..], &long].concat()).stderr(Stdio::piped()).spawn().unwrap();
    let began = Instant::now();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let first: Vec<String> = lines.take(2).collect();
    let took = began.elapsed();
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(first.iter().all(|line| line.starts_with("simulating: ") && !line.contains('\u{1b}')), "{first:?}");
    assert!((Duration::from_secs(19)..Duration::from_secs(60)).contains(&took), "two lines took {took:?}");
}
