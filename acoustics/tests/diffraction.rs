//! Sound round edges, against closed forms.

use crate::common::l_room;
use promenade_acoustics::{Edges, Material, Mesh, Room, Triangle};
use promenade_core::barrier_db;

fn room(mesh: &Mesh) -> Room {
    Room::new(mesh, &[Material::even("wall", 0.1, 0.1)]).unwrap()
}

/// A screen in the plane x = 0 from y = -20 to 20 m, 3 m high.
fn screen() -> Mesh {
    let vertices = vec![[0.0, -20.0, 0.0], [0.0, 20.0, 0.0], [0.0, 20.0, 3.0], [0.0, -20.0, 3.0]];
    let triangles = [[0, 1, 2], [0, 2, 3]].map(|corners| Triangle { corners, group: 0 }).to_vec();
    Mesh { vertices, triangles, groups: vec!["wall".into()] }
}

#[test]
fn a_barrier_takes_what_maekawa_measured() {
    // Fresnel numbers of 0, 1 and 10.
    for (detours, expected) in [(0.0, 5.0), (1.0, 13.0), (10.0, 23.0)] {
        let found = barrier_db(detours * 0.5 * 343.0 / 1000.0, 1000.0, 343.0);
        assert!((found - expected).abs() < 0.2, "{found} for {expected} dB");
    }
}

#[test]
fn the_way_over_a_screen_is_the_shortest_one() {
    let mesh = screen();
    let edges = Edges::of(&mesh);
    let (source, listener) = ([-4.0, 0.0, 1.0], [2.0, 3.0, 1.5]);
    let found = edges.around(&room(&mesh), source, listener).unwrap();
    // Over the top, under it and past both ends; each unfolded.
    let over = ((4.0_f64.hypot(2.0) + 2.0_f64.hypot(1.5)).powi(2) + 9.0).sqrt();
    let under = ((4.0_f64.hypot(1.0) + 2.0_f64.hypot(1.5)).powi(2) + 9.0).sqrt();
    let right = ((4.0_f64.hypot(20.0) + 2.0_f64.hypot(17.0)).powi(2) + 0.25).sqrt();
    let left = ((4.0_f64.hypot(20.0) + 2.0_f64.hypot(23.0)).powi(2) + 0.25).sqrt();
    let ways: Vec<f64> = found.iter().map(|d| d.path_m).collect();
    let mut expected = [over, under, right, left];
    expected.sort_by(f64::total_cmp);
    assert!(ways.len() == 4 && ways.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{ways:?} for {expected:?}");
    let direct = 36.0_f64 + 9.0 + 0.25;
    assert!(found.iter().all(|d| (d.direct_m - direct.sqrt()).abs() < 1e-12));
    // It comes from above the listener, and high frequencies are weaker.
    let top = found.iter().find(|d| (d.path_m - over).abs() < 1e-9).unwrap();
    assert!(top.position[2] > 3.0 && top.position[0] < 0.0, "{:?}", top.position);
    assert!(top.amplitudes().windows(2).all(|pair| pair[1] < pair[0]), "{:?}", top.amplitudes());
    assert!(top.amplitude(125.0) < 1.0 / top.direct_m && top.amplitude(8000.0) > 0.0);
}

#[test]
fn round_the_corner_of_a_room_there_is_one_way() {
    let mesh = l_room();
    let room = room(&mesh);
    let (source, listener) = ([2.0, 5.0, 1.2], [5.0, 2.0, 1.6]);
    let found = Edges::of(&mesh).around(&room, source, listener).unwrap();
    let arms = 2.0 * 1.0_f64.hypot(2.0);
    let expected = (arms * arms + 0.16).sqrt();
    assert!(found.len() == 1 && (found[0].path_m - expected).abs() < 1e-9, "{found:?} for {expected}");
    // The other way round it is as long and as strong.
    let back = Edges::of(&mesh).around(&room, listener, source).unwrap();
    assert!((back[0].path_m - found[0].path_m).abs() < 1e-12 && back[0].detour_m == found[0].detour_m);
    // Whoever is seen is not heard round a corner, and edges that can be gone round from outside only are not.
    assert!(Edges::of(&mesh).around(&room, source, [2.0, 1.0, 1.5]).unwrap().is_empty());
}
