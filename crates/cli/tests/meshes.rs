//! Meshes that people bring: axes and units.

use crate::common::{fails, succeeds};
use crate::simulate::head;
use std::fs;

/// A hall of 6 x 8 x 3 m as Blender exports it, y up; `scale` units are a metre.
fn hall(scale: f64) -> String {
    let corner = |n: usize| {
        let [x, y, z] = [(1, 6.0), (2, 3.0), (4, -8.0)].map(|(bit, length)| if n & bit > 0 { scale * length } else { 0.0 });
        format!("v {x} {y} {z}\n")
    };
    let corners: String = (0..8).map(corner).collect();
    corners + "f 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\nf 1 3 4 2\nf 5 6 8 7\n"
}

#[test]
fn a_room_with_y_up_is_as_high_as_it_was_drawn_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    fs::write(text("hall.obj"), hall(1.0)).unwrap();
    let simulate = |more: &[&str]| {
        let (hall, ears, out) = (text("hall.obj"), text("head"), text("out"));
        let quick = ["--rate", "16000", "--length", "0.1", "--rays", "500", "--beams", "512", "--order", "1", "--poses", "2"];
        let room = ["simulate", &hall, "--emitter", "3,4,1.5", "--materials", "*=0.2", "--head", &ears, "-o", &out];
        [&room[..], &quick, more].concat().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    let said = |more: &[&str]| succeeds(&simulate(more).iter().map(String::as_str).collect::<Vec<_>>()).1;
    // Without turning, the place of the emitter lies outside.
    let guessed = said(&[]);
    assert!(guessed.contains("y is taken for up") && guessed.contains("144.0 m3"), "{guessed}");
    let told = said(&["--up", "y"]);
    assert!(!told.contains("y is taken for up") && told.contains("144.0 m3"), "{told}");
    let kept = fails(&simulate(&["--up", "z"]).iter().map(String::as_str).collect::<Vec<_>>());
    assert!(kept.contains("from 0.00,0.00,-8.00 to 6.00,3.00,0.00"), "{kept}");
    let map = ["map", &text("hall.obj"), "--up", "y", "--emitter", "3,4,1.5", "--materials", "*=0.2", "--grid", "2"];
    succeeds(&[&map[..], &["--rays", "500", "-o", &text("plan.png")]].concat());
}

#[test]
fn inches_and_millimetres_are_refused_with_their_scale() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    head(&folder.path().join("head"));
    for (per_metre, clue) in [(1.0 / 0.0254, "--scale 0.0254 makes it"), (1000.0, "--scale 0.001 makes it")] {
        fs::write(text("hall.obj"), hall(per_metre)).unwrap();
        for command in [
            vec!["simulate", &text("hall.obj"), "--head", &text("head"), "--emitter", "3,4,1.5", "-o", &text("out")],
            vec!["map", &text("hall.obj"), "--emitter", "3,4,1.5", "-o", &text("plan.png")],
            vec!["fit", &text("hall.obj"), &text("head"), "-o", &text("found.obj")],
        ] {
            let said = fails(&command);
            let room = " 6.0 x 8.0 x 3.0 m";
            assert!(said.contains(clue) && said.contains(room) && said.contains("--scale 1 "), "{command:?}: {said}");
        }
    }
    // A nave may be as long as this, but not as high.
    fs::write(text("hall.obj"), hall(21.0)).unwrap();
    let said = fails(&["map", &text("hall.obj"), "--emitter", "3,4,1.5", "-o", &text("plan.png")]);
    assert!(said.contains("126.0000 x 168.0000 x 63.0000 m, which no room is"), "{said}");
}
