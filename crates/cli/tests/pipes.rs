//! `-` for standard input and output: sounds, paths and JSON through pipes.

use crate::common::{Place, fails, promenade, succeeds};
use std::fs::{self, File};
use std::process::{Command, Output, Stdio};

/// Runs it with a file as standard input.
fn fed(input: &str, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_promenade"));
    let out =
        command.args(args).stdin(File::open(input).unwrap()).stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap();
    assert!(out.status.success(), "{args:?}: {}", String::from_utf8_lossy(&out.stderr));
    out
}

#[test]
fn sounds_and_paths_go_through_pipes_and_messages_to_standard_error() {
    let place = Place::new();
    let (scene, input, out) = (place.bake(), place.dry("in.wav", 0.4, 1), place.text("out.wav"));
    let walk = place.text("walk.json");
    fs::write(&walk, r#"[{"t":0,"position":[0,0,0],"ypr":[-90,0,0]},{"t":0.4,"position":[0,0,0],"ypr":[90,0,0]}]"#).unwrap();
    succeeds(&["render", &scene, &input, "-o", &out, "--path", &walk]);
    let whole = fs::read(&out).unwrap();
    let piped = fed(&input, &["render", &scene, "-", "-", "--path", &walk]);
    assert!(piped.stdout == whole, "the same bytes through pipes");
    assert!(String::from_utf8_lossy(&piped.stderr).contains("times real time"));
    assert!(fed(&walk, &["render", &scene, &input, "-o", "-", "--path", "-"]).stdout == whole, "a path from a pipe");
    // FLAC is looked at before it is read.
    let flac = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/phrase.flac");
    let mut sound = fed(flac, &["render", &scene, "-", "-o", "-", "--mix", "0.5"]).stdout;
    assert_eq!(sound.drain(..4).collect::<Vec<_>>(), b"RIFF");

    let converted = fed(&walk, &["path", "-", "-o", "-"]);
    let keyframes: serde_json::Value = serde_json::from_slice(&converted.stdout).unwrap();
    assert_eq!(keyframes.as_array().unwrap().len(), 2);
    assert!(String::from_utf8_lossy(&converted.stderr).contains("2 keyframes"));

    let saliency = fed(&input, &["map", "saliency", "-", "-o", "-"]);
    let weights: serde_json::Value = serde_json::from_slice(&saliency.stdout).unwrap();
    assert!(weights["frames"].as_array().unwrap().len() >= 10, "{weights}");
    assert!(String::from_utf8_lossy(&saliency.stderr).contains("samples per pixel"));

    let figures = fed(&out, &["measure", "--response", "-"]);
    assert!(serde_json::from_slice::<serde_json::Value>(&figures.stdout).unwrap()["response"].is_object());
    assert!(!place.names().iter().any(|name| name == "-"), "{:?}", place.names());
    assert!(fed("/dev/null", &["inspect", &scene]).stderr.is_empty());
}

#[test]
fn figures_go_where_they_are_asked_for() {
    let place = Place::new();
    let (scene, file) = (place.bake(), place.text("figures.json"));
    let printed: serde_json::Value = serde_json::from_slice(&promenade(&["inspect", &scene, "--json"]).stdout).unwrap();
    let (text, _) = succeeds(&["inspect", &scene, "--json", &file]);
    assert!(text.starts_with("title"), "{text}");
    assert_eq!(serde_json::from_slice::<serde_json::Value>(&fs::read(&file).unwrap()).unwrap(), printed);
    let (markdown, _) = succeeds(&["measure", &scene, "--markdown"]);
    assert!(markdown.starts_with("| held-out pose"), "{markdown}");
}

#[test]
fn an_empty_pipe_is_no_sound() {
    let place = Place::new();
    let scene = place.bake();
    // The tests' own standard input is empty.
    let said = fails(&["render", &scene, "-", "-o", &place.text("out.wav")]);
    assert!(
        said.contains("-: expected a WAV, FLAC or AIFF file, found an empty file") || said.contains("a terminal"),
        "{said}"
    );
    let said = fails(&["path", "-"]);
    assert!(said.contains("found an empty file") || said.contains("a terminal"), "{said}");
}
