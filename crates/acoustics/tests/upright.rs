//! Which way up meshes are taken.

use promenade_acoustics::Mesh;
use std::fs;
use std::path::{Path, PathBuf};

/// The mesh of a file, whether it was turned by a guess, and its bounds.
fn stood(path: &Path, up: Option<[f64; 3]>) -> (bool, [[f64; 3]; 2]) {
    let mut mesh = Mesh::load(path).unwrap();
    let guessed = mesh.stand_up(path, up);
    (guessed, mesh.bounds())
}

/// A box from a corner, its surfaces across y in the group `across_y` and its others in `others`.
fn box_file(folder: &Path, [low, high]: [[i32; 3]; 2], [across_y, others]: [&str; 2]) -> PathBuf {
    let ends = |axis: usize, high_end: bool| if high_end { high[axis] } else { low[axis] };
    let corner = |n: usize| format!("v {} {} {}\n", ends(0, n & 1 > 0), ends(1, n & 2 > 0), ends(2, n & 4 > 0));
    let corners: String = (0..8).map(corner).collect();
    let path = folder.join("box.obj");
    let faces =
        format!("usemtl {across_y}\nf 1 2 6 5\nf 3 7 8 4\nusemtl {others}\nf 1 5 7 3\nf 2 4 8 6\nf 1 3 4 2\nf 5 6 8 7\n");
    fs::write(&path, corners + &faces).unwrap();
    path
}

#[test]
fn a_mesh_with_y_up_is_turned_as_it_is_told_or_as_it_seems() {
    let folder = tempfile::tempdir().unwrap();
    // 6 m wide, 3 m high and 8 m deep, from Blender: its y is -z here.
    let hall = box_file(folder.path(), [[0, 0, -8], [6, 3, 0]], ["a", "b"]);
    let upright = [[0.0; 3], [6.0, 8.0, 3.0]];
    assert_eq!(stood(&hall, None), (true, upright));
    assert_eq!(stood(&hall, Some([0.0, 2.0, 0.0])), (false, upright));
    assert_eq!(stood(&hall, Some([0.0, 0.0, 1.0])), (false, [[0.0, 0.0, -8.0], [6.0, 3.0, 0.0]]));
    assert_eq!(stood(&hall, Some([0.0, -1.0, 0.0])).1, [[0.0, -8.0, -3.0], [6.0, 0.0, 0.0]]);
    // A shaft is as tall; what is called floor decides, either way.
    let shaft = box_file(folder.path(), [[0, 0, 0], [6, 3, 8]], ["wall", "Floor tiles"]);
    assert!(!stood(&shaft, None).0);
    let wide = box_file(folder.path(), [[0, 0, 0], [10, 3, 6]], ["wood_floor", "plaster"]);
    assert_eq!(stood(&wide, None), (true, [[0.0, -6.0, 0.0], [10.0, 0.0, 3.0]]));
    // Nothing says that this one lies.
    let wide = box_file(folder.path(), [[0, 0, 0], [10, 3, 6]], ["a", "b"]);
    assert!(!stood(&wide, None).0);
}

#[test]
fn rooms_that_stand_stay_as_they_are() {
    let mut count = 0;
    for folder in ["presets/library", "presets/scenes", "data"] {
        for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let Ok(mesh) = Mesh::load(&path) else { continue };
            assert_eq!(stood(&path, None), (false, mesh.bounds()), "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 12, "only {count} meshes are found");
}
