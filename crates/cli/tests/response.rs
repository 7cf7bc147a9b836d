//! What the editor shows of a response is what the command line measures of one.

use crate::common::succeeds;
use promenade_baker::wav::{self, Format};
use promenade_core::{BlockParams, OCTAVES_HZ, Pose, Scene};
use promenade_judge::response_s;
use promenade_plugin::answers::response::Listening;
use promenade_plugin::answers::settled::Question;
use std::sync::Arc;

const RATE: u32 = 48_000;
const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/iosr-room-a.promenade");

#[test]
fn the_editor_and_the_command_line_measure_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let name = |file: &str| folder.path().join(file).to_str().unwrap().to_owned();
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(SCENE).unwrap()).unwrap());
    let mut impulse = vec![0.0; 2_000 + (response_s(&scene) * f64::from(RATE)) as usize];
    impulse[2_000] = 1.0;
    wav::write(&folder.path().join("impulse.wav"), RATE, &[&impulse], Format::Float32).unwrap();
    let mut seen = Vec::new();
    for (text, yaw_deg) in [("0.5,0,0,30,0,0", 30.0_f32), ("0.5,0,0,-90,0,0", -90.0)] {
        succeeds(&["render", SCENE, &name("impulse.wav"), &name("out.wav"), "--pose", text, "--bits", "32f"]);
        let measured = crate::common::json(&["measure", "--response", &name("out.wav")]);
        let pose = Pose::from_ypr([0.5, 0.0, 0.0].into(), yaw_deg.to_radians(), 0.0, 0.0);
        let asked = Listening::new(&scene, f64::from(RATE), pose, BlockParams::default(), None);
        let shown = asked.answer(&|| true).unwrap();
        for (shown, of) in [(shown.t20_s, "t20_s"), (shown.c50_db, "c50_db")] {
            let measured = measured["response"][of].as_f64().unwrap();
            assert!((shown.unwrap() / measured - 1.0).abs() < 0.005, "{of}: {shown:?} in the editor, {measured} measured");
        }
        seen.push(shown);
    }
    assert_ne!(seen[0].spectrum_db, seen[1].spectrum_db, "the pose makes no difference");
    assert!(OCTAVES_HZ.is_sorted());
}
