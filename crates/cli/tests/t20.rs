//! `promenade fit ROOM --t20`.

use crate::common::{all_fail, promenade, succeeds};
use promenade_baker::wav::{self, Format};
use promenade_testing::Noise;
use std::path::Path;

/// The numbers of a row of a table in Markdown.
fn row(text: &str, name: &str) -> Vec<f64> {
    let line = text.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{name}: {text}"));
    line.split('|').filter_map(|cell| cell.trim().parse().ok()).collect()
}

#[test]
fn a_room_gets_the_times_that_are_typed_or_measured() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (room, response) = (text("room.obj"), text("decay.wav"));
    let rules = "floor=carpet_thin,*=plasterboard";
    let typed = [".5,.5,.4,.4,.35,.3,.3", "-o", &room, "--markdown", "--materials", rules];
    let (table, _) = succeeds(&[&["fit", "6x4x3", "--t20"], &typed[..]].concat());
    for (found, asked) in row(&table, "fitted").iter().zip(row(&table, "asked for")) {
        assert!((found / asked - 1.0).abs() < 0.03, "{table}");
    }
    let beside = std::fs::read_to_string(text("room.materials.json")).unwrap();
    assert!(beside.contains("\"floor\"") && Path::new(&room).exists(), "{beside}");

    let mut noise = Noise::new(1);
    let fall = 3.0 * std::f32::consts::LN_10 / (0.7 * 48_000.0);
    let samples: Vec<f32> = (0..48_000).map(|i| 0.3 * (-fall * i as f32).exp() * noise.value()).collect();
    wav::write(Path::new(&response), 48_000, &[&samples], Format::Float32).unwrap();
    let (table, _) = succeeds(&["fit", "6,4,3", "--t20", &response, "--markdown"]);
    assert!(row(&table, "asked for")[2..].iter().all(|t| (t / 0.7 - 1.0).abs() < 0.12), "{table}");

    let (_, said) = {
        let out = promenade(&["fit", "6,4,3", "--t20", "-,-,.6,-,-,-,9"]);
        (out.stdout, String::from_utf8(out.stderr).unwrap())
    };
    assert!(said.contains("8000 Hz: 9.00 s cannot be reached"), "{said}");
    wav::write(Path::new(&response), 48_000, &[&samples[..2000]], Format::Float32).unwrap();
    all_fail(&[
        (vec!["fit", "6,4,3", "--t20", &response], "expected a response that decays by 25 dB"),
        (vec!["fit", "6,4,3", "--t20", ".01,-,-,-,-,-,-"], "reverberation time: expected 0.05 to 20 s"),
        (vec!["fit", "6000,4000,3000", "--t20", ".4,-,-,-,-,-,-"], "lengths of the room: expected 0.5 to 200 m"),
        (vec!["fit", "6,4,3", "x", "--t20", ".4,-,-,-,-,-,-"], "a room alone"),
        (vec!["fit", "6,4,3", "-o", "a.promenade", "--t20", ".4,-,-,-,-,-,-"], "ending in .obj"),
    ]);
}
