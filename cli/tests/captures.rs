//! Captures and evaluation from the command line.

mod common;

use common::{Place, fails, promenade, succeeds};
use promenade_baker::wav;
use std::path::Path;

fn speech() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/speech.wav").to_str().unwrap().to_owned()
}

#[test]
fn a_capture_is_made_checked_and_evaluated() {
    let place = Place::new();
    let (scene, room, speech) = (place.bake(), place.folder.path().to_str().unwrap(), speech());
    let capture = place.text("capture");
    let (_, said) = succeeds(&[
        "capture",
        "from-responses",
        room,
        "--dry",
        &speech,
        "-o",
        &capture,
        "--clip",
        "0.5",
        "--clips",
        "2",
        "--test-share",
        "0.3",
    ]);
    assert!(said.contains("13 tracks") && said.contains("8 to judge by"), "{said}");
    let (text, _) = succeeds(&["capture", "check", &capture]);
    assert!(text.contains("test room") && text.contains("test left") && text.contains("2.00, 0.00, 0.00 m"), "{text}");
    let json: serde_json::Value = serde_json::from_str(&succeeds(&["capture", "check", &capture, "--json"]).0).unwrap();
    assert_eq!((json["splits"][1]["clips"].as_u64(), json["sample_rate_hz"].as_f64()), (Some(8), Some(16_000.0)));
    assert!(json["splits"][0]["left"]["mean_dbfs"].as_f64().unwrap() > -40.0, "{json}");

    let names = ["e.json", "e.md", "plots", "wavs"].map(|n| place.text(n));
    let [json, markdown, plots, wavs] = &names;
    let (table, _) = succeeds(&[
        "eval",
        &scene,
        &capture,
        &capture,
        "--json",
        json,
        "--markdown",
        markdown,
        "--plots",
        plots,
        "--wavs",
        wavs,
    ]);
    assert!(table.contains("test room on test room: 8 test clips at 16000 Hz, tier standard"), "{table}");
    assert!(table.contains("Mean over 2 captures") && table.contains("stereo-energy *"), "{table}");
    let markdown = std::fs::read_to_string(markdown).unwrap();
    assert!(markdown.contains("| method") && markdown.contains("MAG (RWAVS)"), "{markdown}");
    let json: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let methods = json["evaluations"][1]["methods"].as_array().unwrap();
    let mag = |i: usize| methods[i]["mean"]["avcloud_mag"].as_f64().unwrap();
    assert_eq!(
        (methods.len(), methods[1]["name"].as_str(), methods[0]["clips"].as_array().unwrap().len()),
        (7, Some("mono-mono"), 8)
    );
    assert!(mag(0) < mag(1), "{} {}", mag(0), mag(1));
    assert_eq!(json["overall"][0]["mean"], methods[0]["mean"]);
    let plot = std::fs::read_to_string(Path::new(plots).join("avcloud_mag.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.ends_with("</svg>\n") && plot.matches("<rect").count() == 1 + 7, "{plot}");
    assert_eq!(std::fs::read_dir(plots).unwrap().count(), 10);
    let written: Vec<_> = std::fs::read_dir(Path::new(wavs).join("01-test_room")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(written.len(), 8 * 8, "seven methods and the recording");
    assert_eq!(wav::read(&written[0]).unwrap().frames(), 8_000);

    let (alone, _) =
        succeeds(&["eval", &scene, &capture, "--no-baselines", "--tier", "draft", "--fit-level", "--poses", "path"]);
    assert!(alone.contains("tier draft") && alone.contains("level was fitted") && !alone.contains("mono"), "{alone}");
}

#[test]
fn mistakes_are_one_line() {
    let place = Place::new();
    let (scene, capture, speech) = (place.bake(), place.text("capture"), speech());
    let room = place.folder.path().to_str().unwrap();
    succeeds(&["capture", "from-responses", room, "--dry", &speech, "-o", &capture]);
    assert!(
        fails(&["capture", "from-responses", room, "-o", &capture]).contains("dry sound: expected at least one, found none")
    );
    assert!(fails(&["eval", &capture, &scene]).contains("expected a scene first, found a capture"));
    assert!(fails(&["eval", &scene, &capture, "--tier", "high"]).contains("tier: expected draft or standard, found high"));
    assert!(fails(&["capture", "check", &scene]).contains("room.promenade"));
    let import = |more: &[&str]| fails(&[&["capture", "import", room, "-o", &place.text("x")], more].concat());
    assert!(import(&["--layout", "rwavs"]).contains("transforms_scale_train.json: cannot be read"));
    assert!(import(&["--layout", "replay"]).contains("near: cannot be read"));
    assert!(import(&["--layout", "raf"]).contains("expected folders with a rir.wav, found none"));
    assert!(import(&["--layout", "responses"]).contains("poses.npy, poses.json or poses.txt"));
    assert!(import(&["--layout", "rwavs", "--dry", &speech]).contains("--dry is for layouts of responses"));
    assert!(!place.path("x").exists());
    assert_eq!(promenade(&["eval", &scene]).status.code(), Some(2));
    assert_eq!(promenade(&["capture", "import", room, "-o", "x", "--layout", "other"]).status.code(), Some(2));
    // Rows of poses beside the responses make a capture of their own.
    let rows: String = (0..13).map(|i| format!("0 0 0 {} 0 0\n", 15 * i - 90)).collect();
    std::fs::write(place.path("poses.txt"), rows).unwrap();
    let imported = place.text("imported");
    let (_, said) = succeeds(&[
        "capture",
        "import",
        room,
        "--layout",
        "responses",
        "--dry",
        &speech,
        "--emitter",
        "2,0,0",
        "-o",
        &imported,
    ]);
    assert!(said.contains("13 tracks"), "{said}");
}
