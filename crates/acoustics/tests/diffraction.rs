//! Sound round edges, against closed forms.

use crate::common::{l_room, two_rooms};
use promenade_acoustics::{Edges, ImageOptions, Images, Material, Mesh, Reflected, Room, Triangle};
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
    let found = edges.paths(&room(&mesh), source, listener).unwrap();
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
    let found = Edges::of(&mesh).paths(&room, source, listener).unwrap();
    let arms = 2.0 * 1.0_f64.hypot(2.0);
    let expected = (arms * arms + 0.16).sqrt();
    assert!(found.len() == 1 && (found[0].path_m - expected).abs() < 1e-9, "{found:?} for {expected}");
    // The other way round it is as long and as strong.
    let back = Edges::of(&mesh).paths(&room, listener, source).unwrap();
    assert!((back[0].path_m - found[0].path_m).abs() < 1e-12 && back[0].detour_m == found[0].detour_m);
    // Whoever is seen is not heard round a corner, and edges that can be gone round from outside only are not.
    assert!(Edges::of(&mesh).paths(&room, source, [2.0, 1.0, 1.5]).unwrap().is_empty());
}

#[test]
fn through_a_doorway_in_a_thick_wall_sound_goes_round_two_edges() {
    let mesh = two_rooms();
    let room = room(&mesh);
    let edges = Edges::of(&mesh);
    let (source, listener) = ([3.6, 3.7, 1.2], [4.8, 3.7, 1.6]);
    assert!(edges.paths(&room, source, listener).unwrap().is_empty(), "neither jamb is seen from both sides");
    let found = edges.paths_round_two(&room, source, listener).unwrap();
    let expected = (2.0 * 0.4_f64.hypot(1.3) + 0.4).hypot(0.4);
    assert!(found.len() == 1 && (found[0].path_m - expected).abs() < 1e-4, "{found:?} for {expected}");
    // It comes from the doorway.
    let towards: [f64; 2] = std::array::from_fn(|a| found[0].position[a] - listener[a]);
    assert!((towards[1] / towards[0] - 1.3 / 0.4).abs() < 1e-3, "{towards:?}");
    let back = edges.paths_round_two(&room, listener, source).unwrap();
    assert!((back[0].path_m - found[0].path_m).abs() < 1e-4);
    // Where the wall is left behind, all goes on as round one.
    let border = [4.4 + 0.5, 2.4 + 1e-3, 1.2];
    let [one, two] = [[border[0], 2.4 - 1e-3, 1.2], border].map(|at| {
        let first = edges.paths(&room, source, at).unwrap();
        let all = if first.is_empty() { edges.paths_round_two(&room, source, at).unwrap() } else { first };
        (all[0].path_m, 20.0 * all[0].amplitude(1000.0).log10())
    });
    assert!((one.0 - two.0).abs() < 5e-3 && (one.1 - two.1).abs() < 0.5, "{one:?} {two:?}");
}

#[test]
fn images_come_round_edges_too() {
    let mesh = l_room();
    let room = room(&mesh);
    let (source, listener) = ([2.0, 5.0, 1.2], [5.0, 2.0, 1.6]);
    let images = Images::new(&room, source, &ImageOptions::default()).unwrap();
    let edges = Edges::of(&mesh);
    let found = edges.diffracted_images(&room, &images, Reflected::Specular).unwrap().paths(listener).unwrap();
    // The source behind the wall that both arms see is behind the corner as it is itself.
    let expected = (1.0_f64.hypot(4.0) + 2.0_f64.hypot(1.0)).hypot(0.4);
    let behind = [2.0, 7.0, 1.2];
    let one = found.iter().find(|way| (0..3).all(|a| (way.from[a] - behind[a]).abs() < 1e-6)).unwrap();
    assert!((one.path_m - expected).abs() < 1e-6, "{one:?} for {expected}");
    assert!(
        one.gains.iter().all(|gain| (gain - 0.9).abs() < 1e-6),
        "a tenth is absorbed, a tenth of the rest scattered: {one:?}"
    );
    // Of other orders there may be images in the same places.
    let mut seen = images.seen_from(&room, listener, Reflected::Specular).unwrap();
    seen.retain(|image| image.order <= 2);
    let far = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>();
    let both = found.iter().filter(|way| !way.lit).find(|way| seen.iter().any(|image| far(way.from, image.position) < 1e-6));
    assert!(both.is_none(), "what is seen is not bent: {both:?} ");
    assert!(found.windows(2).all(|pair| pair[0].amplitude(1000.0).abs() >= pair[1].amplitude(1000.0).abs()));
}

/// Level of the direct sound or of what comes round edges in its place at a frequency, dB beside 1 m.
fn level_db(edges: &Edges, room: &Room, source: [f64; 3], at: [f64; 3], hz: f64) -> f64 {
    let energy = if room.sees(source, at).unwrap() {
        let way = (0..3).map(|a| (source[a] - at[a]).powi(2)).sum::<f64>().sqrt();
        let lit = edges.beside_shadows(room, source, at).unwrap();
        (lit.iter().map(|lit| 1.0 + lit.amplitude(hz) * way).product::<f64>() / way).powi(2)
    } else {
        edges.paths_round_one_or_two(room, source, at).unwrap().iter().map(|way| way.amplitude(hz).powi(2)).sum()
    };
    10.0 * energy.log10()
}

/// Out of the shadow, along its border, and where source, edge and listener lie on one line.
#[test]
fn borders_of_shadows_have_no_step_and_nothing_is_silent() {
    // In an L, and past the doorway of a thick wall, where the ways go round one jamb and round both.
    let walks: [(Mesh, [[f64; 3]; 3]); 5] = [
        (l_room(), [[1.3, 4.9, 1.2], [5.7, 1.4, 1.6], [0.4, 1.4, 1.6]]),
        (l_room(), [[2.0, 5.0, 1.2], [4.9, 2.7, 1.5], [2.4, 0.3, 1.5]]),
        (two_rooms(), [[3.3, 3.5, 1.5], [6.0, 0.6, 1.5], [6.0, 3.6, 1.5]]),
        (two_rooms(), [[3.3, 2.6, 1.2], [5.6, 0.6, 1.5], [5.6, 3.6, 1.5]]),
        (two_rooms(), [[3.3, 3.5, 1.5], [5.2, 1.9, 1.5], [7.5, 3.0, 1.5]]),
    ];
    for (mesh, [source, from, to]) in walks {
        let (room, edges) = (room(&mesh), Edges::of(&mesh));
        let length = (0..3).map(|a| (to[a] - from[a]).powi(2)).sum::<f64>().sqrt();
        let steps = (100.0 * length) as u32;
        let at = |step: u32| -> [f64; 3] {
            std::array::from_fn(|a| from[a] + (to[a] - from[a]) * f64::from(step) / f64::from(steps))
        };
        for hz in [500.0, 1000.0, 2000.0, 4000.0, 8000.0] {
            let levels: Vec<f64> = (0..=steps).map(|step| level_db(&edges, &room, source, at(step), hz)).collect();
            let (mut most, mut where_m) = (0.0, 0);
            for (step, pair) in levels.windows(2).enumerate() {
                if (pair[1] - pair[0]).abs() > most {
                    (most, where_m) = ((pair[1] - pair[0]).abs(), step);
                }
            }
            println!("{hz} Hz from {source:?} at {:.2?}: {most:.2} dB", at(where_m as u32));
            // From 4 kHz on the formula itself rises by more than half a decibel within a centimetre of light.
            let bar = if hz < 4000.0 { 0.5 } else { 1.0 };
            assert!(levels.iter().all(|db| db.is_finite()) && most < bar, "{hz} Hz at {:?}: {most} dB", at(where_m as u32));
        }
    }
    // A screen of 3 m, and all of one height over its end.
    let (mesh, source) = (screen(), [-4.0, 20.0, 1.5]);
    let (room, edges) = (room(&mesh), Edges::of(&mesh));
    let levels = [-1e-3, -1e-6, 0.0, 1e-6, 1e-3].map(|off| level_db(&edges, &room, source, [4.0, 20.0 + off, 1.5], 1000.0));
    let free = 20.0 * 8.0_f64.recip().log10();
    assert!(levels.iter().all(|db| (db - free + 5.0).abs() < 0.5), "{levels:?} for {free}");
}
