use crate::geometry::{GeometryOptions, bake_geometry};
use crate::sources::simulation::heads::{RATE, transparent};
use crate::sources::simulation::{MeshOptions, Part, SPEED_OF_SOUND_M_S, simulate_mesh};
use promenade_acoustics::{Material, Mesh, Room, Source, Triangle};
use promenade_core::glam::Vec3;
use promenade_core::{Pose, Scene};
use promenade_player::render_response;
use std::path::Path;
use std::sync::Arc;

const LEAD: usize = 256;
const HEIGHT_M: f32 = 1.5;

fn options() -> GeometryOptions {
    GeometryOptions {
        images: 10,
        head_turns: 1,
        order: 2,
        beams: 8192,
        rays: 500,
        spacing_m: 1.0,
        height_m: HEIGHT_M,
        layered: false,
        margin_m: 0.3,
        air: None,
        waves_hz: Some(0.0),
        gain_db: 0.0,
        seed: 1,
        title: "corners".to_owned(),
        recipe: String::new(),
    }
}

/// How loud what arrives after some metres is in a scene and in responses of the same room, dB of the one over the other, and
/// how much later, seconds.
fn beside(mesh: &Mesh, walls: &[Material], emitter: Vec3, at: &[(Vec3, f32)]) -> Vec<(f64, f64)> {
    let room = Room::new(mesh, walls).unwrap();
    let source: Source = emitter.as_dvec3().to_array().into();
    let hrtf = transparent();
    let scene = bake_geometry(mesh, &room, &source, &hrtf, &options(), |_| ()).unwrap();
    let bytes = scene.to_bytes().unwrap();
    let again = Scene::from_bytes(&bytes).unwrap();
    assert!(again.corners() == scene.corners() && again.to_bytes().unwrap() == bytes);
    let scene = Arc::new(scene);
    let truth = MeshOptions {
        order: 2,
        beams: 8192,
        rays: 500,
        t30_within: None,
        length_s: Some(0.1),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    let samples = |metres: f32| f64::from(metres) / f64::from(SPEED_OF_SOUND_M_S) * f64::from(RATE);
    let part = |x: &[f32], arrival: f64| {
        let from = (arrival - 0.0006 * f64::from(RATE)).round();
        let part = &x[from as usize..][..(0.0012 * f64::from(RATE)) as usize];
        let energy: f64 = part.iter().map(|v| f64::from(*v).powi(2)).sum();
        let middle = part.iter().enumerate().map(|(i, v)| i as f64 * f64::from(*v).powi(2)).sum::<f64>() / energy;
        (energy, middle + from - arrival)
    };
    let one = |(at, way_m): &(Vec3, f32)| {
        let pose = Pose::from_ypr(*at, 0.3, 0.0, 0.0);
        let heard = render_response(&scene, pose, LEAD, 2048).unwrap();
        let made = simulate_mesh(mesh, &room, &source, &hrtf, &[pose], &truth, |_| ()).unwrap();
        let (ear, ear_at) = part(&heard[0], LEAD as f64 + samples(way_m - at.distance(emitter)));
        let (truth, truth_at) = part(&made.responses.responses[0].left, samples(*way_m));
        (10.0 * (ear / truth).log10(), (ear_at - truth_at) / f64::from(RATE))
    };
    at.iter().map(one).collect()
}

fn loft() -> Mesh {
    Mesh::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/library/l-shaped-loft.obj")).unwrap()
}

#[test]
fn an_image_is_heard_round_the_corner_of_the_loft() {
    // Only the wall behind the emitter reflects.
    let mut mesh = loft();
    mesh.groups = ["open", "wall"].map(str::to_owned).to_vec();
    for triangle in &mut mesh.triangles {
        triangle.group = u32::from(triangle.corners.iter().all(|c| mesh.vertices[*c as usize][0] < 1e-6));
    }
    let walls = [Material::even("open", 0.9999, 0.0), Material::even("wall", 0.1, 0.0)];
    let emitter = Vec3::new(2.4, 7.6, HEIGHT_M);
    let (image, corner) = (Vec3::new(-2.4, 7.6, HEIGHT_M), Vec3::new(5.0, 4.5, HEIGHT_M));
    let seen = (Vec3::new(3.0, 2.6, HEIGHT_M), Vec3::new(3.0, 2.6, HEIGHT_M).distance(image));
    // Its shadow begins at y = 4.5 - (x - 5) * 3.1 / 7.4.
    let round = [[7.5, 4.1], [9.0, 4.0], [10.6, 3.8]].map(|[x, y]| {
        let at = Vec3::new(x, y, HEIGHT_M);
        (at, image.distance(corner) + corner.distance(at))
    });
    // As near to the border on the plan, at x = 7.5 m, as to both sides of it.
    let near = |off: f32| Vec3::new(7.5, 4.5 - 2.5 * 3.1 / 7.4 + off, HEIGHT_M);
    let lit = [-0.9, -0.6, -0.3, -0.15].map(|off| (near(off), near(off).distance(image)));
    let dim = [0.15, 0.3, 0.6].map(|off| (near(off), image.distance(corner) + corner.distance(near(off))));
    let places = [&[seen], &round[..], &lit, &dim].concat();
    let found = beside(&mesh, &walls, emitter, &places);
    for ((at, _), (db, late_s)) in places.iter().zip(&found) {
        let off = db - found[0].0;
        println!("{at}: {off:+.2} dB, {:+.1} us", 1e6 * late_s);
        assert!(off.abs() < 1.0 && late_s.abs() < 20e-6, "{at}: {off} dB, {late_s} s");
    }
}

/// Two rooms of 4 x 4 m with a doorway of .9 m in the wall of .4 m between them.
fn two_rooms() -> Mesh {
    let plan = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 1.5],
        [4.4, 1.5],
        [4.4, 0.0],
        [8.4, 0.0],
        [8.4, 4.0],
        [4.4, 4.0],
        [4.4, 2.4],
        [4.0, 2.4],
        [4.0, 4.0],
        [0.0, 4.0],
    ];
    let flat: [[u32; 3]; 10] =
        [[0, 1, 2], [0, 2, 9], [0, 9, 10], [0, 10, 11], [6, 7, 8], [6, 8, 3], [6, 3, 4], [6, 4, 5], [2, 3, 8], [2, 8, 9]];
    let level = |z: f64| plan.iter().map(move |[x, y]| [*x, *y, z]);
    let walls = (0..12).flat_map(|i| {
        let j = (i + 1) % 12;
        [[j, i, i + 12], [j, i + 12, j + 12]]
    });
    let ceiling = flat.iter().map(|[a, b, c]| [c + 12, b + 12, a + 12]);
    let triangles = flat.iter().copied().chain(ceiling).chain(walls).map(|corners| Triangle { corners, group: 0 });
    Mesh { vertices: level(0.0).chain(level(2.5)).collect(), triangles: triangles.collect(), groups: vec!["wall".to_owned()] }
}

#[test]
fn through_a_doorway_the_emitter_is_heard_round_one_jamb_and_round_two() {
    let emitter = Vec3::new(3.3, 3.5, HEIGHT_M);
    let [first, second] = [Vec3::new(4.0, 2.4, HEIGHT_M), Vec3::new(4.4, 2.4, HEIGHT_M)];
    // In sight through the doorway; hidden by the near jamb; by both.
    let places = [Vec3::new(3.0, 1.5, HEIGHT_M), Vec3::new(6.0, 1.9, HEIGHT_M), Vec3::new(6.3, 3.2, HEIGHT_M)];
    let places = [places[0], places[1], places[2], Vec3::new(5.0, 3.4, HEIGHT_M)];
    let ways = [
        emitter.distance(places[0]),
        emitter.distance(first) + first.distance(places[1]),
        emitter.distance(first) + 0.4 + second.distance(places[2]),
        emitter.distance(first) + 0.4 + second.distance(places[3]),
    ];
    let at: Vec<(Vec3, f32)> = places.into_iter().zip(ways).collect();
    let found = beside(&two_rooms(), &[Material::even("wall", 0.99, 0.0)], emitter, &at);
    for ((at, _), (db, late_s)) in at.iter().zip(&found) {
        println!("{at}: {:+.2} dB, {:+.1} us", db - found[0].0, 1e6 * late_s);
        assert!((db - found[0].0).abs() < 1.0 && late_s.abs() < 30e-6, "{found:?}");
    }
}
