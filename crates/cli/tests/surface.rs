//! `promenade surface`: rooms around the points of a reconstruction.

use crate::common::{Place, all_fail, succeeds};
use promenade_acoustics::Mesh;
use std::fmt::Write;
use std::path::Path;

/// A COLMAP model of a room of 5 x 3 x 2 units about the origin, y down, in which a unit is 2 m.
fn model(place: &Place) -> String {
    let folder = place.path("model");
    std::fs::create_dir(&folder).unwrap();
    let images = "1 1 0 0 0 0 0 0 1 00001.jpg\n\n2 1 0 0 0 0 0 -1 1 00002.jpg\n\n";
    std::fs::write(folder.join("images.txt"), images).unwrap();
    let mut points = String::new();
    let mut number = 0;
    // Along x, down, and ahead as the cameras look.
    let size = [5.0, 2.0, 3.0];
    for wall in 0..6 {
        for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (i, j))) {
            let mut at = [0.0; 3];
            let axis = wall / 2;
            at[axis] = size[axis] * (0.5 - f64::from(u8::from(wall % 2 == 0)));
            for (other, step) in (0..3).filter(|other| *other != axis).zip([i, j]) {
                at[other] = size[other] * (f64::from(step) / 19.0 - 0.5);
            }
            number += 1;
            let [x, y, z] = at;
            writeln!(points, "{number} {x} {y} {z} 200 100 50 0.5 1 {number} 2 {number}").unwrap();
        }
    }
    std::fs::write(folder.join("points3D.txt"), points).unwrap();
    folder.to_str().unwrap().to_owned()
}

#[test]
fn a_reconstruction_becomes_a_room_in_metres_with_named_walls() {
    let place = Place::new();
    let (model, room) = (model(&place), place.text("room.obj"));
    for (shape, groups) in [("box", 6), ("free", 3)] {
        let scaled = ["--distance", "00001.jpg", "00002.jpg", "2", "--cell", "0.2"];
        let (_, said) = succeeds(&[&["surface", &model, "-o", &room, "--shape", shape], &scaled[..]].concat());
        assert!(said.contains("around 2400 points") && said.contains("2 of 2 cameras are inside"), "{said}");
        assert!(shape != "box" || said.contains("points on the walls: back"), "{said}");
        let mesh = Mesh::load(Path::new(&room)).unwrap();
        assert_eq!(mesh.groups.len(), groups, "{:?}", mesh.groups);
        let [low, high] = mesh.bounds();
        let mut size = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let height = size[2];
        size.sort_by(f64::total_cmp);
        // Cells round to 0.2 m.
        let near = |found: f64, stated: f64| (found - stated).abs() < if shape == "box" { 0.01 } else { 0.21 };
        assert!(near(height, 4.0) && near(size[2], 10.0) && near(size[1], 6.0), "{shape}: {low:?} {high:?}");
    }
}

#[test]
fn what_makes_no_room_is_refused() {
    let place = Place::new();
    let (model, cloud, out) = (model(&place), place.text("cloud.ply"), place.text("room.obj"));
    let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(&cloud, format!("{header}0 0 0\n1 0 0\n0 1 0\n")).unwrap();
    all_fail(&[
        (vec!["surface", &model, "-o", "room.stl"], "expected a file ending in .obj"),
        (vec!["surface", &model, "-o", &out, "--cell", "0"], "--cell: expected more than 0 m, found 0"),
        (vec!["surface", &cloud, "-o", &out], "cloud.ply"),
        (vec!["surface", "nowhere", "-o", &out], "nowhere"),
    ]);
    assert!(!Path::new(&out).exists());
}
