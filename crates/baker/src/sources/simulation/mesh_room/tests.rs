use super::*;
use crate::sources::simulation::heads::{RATE, transparent, two_sided};
use crate::sources::simulation::{Inside, SPEED_OF_SOUND_M_S, grid, random_inside, simulate_box, turned};
use promenade_acoustics::{Directivity, Material, Shoebox, Triangle};
use promenade_core::random::Random;
use promenade_metrics::{DecayRange, decay_time_s};

const SIZE: Vec3 = Vec3::new(7.0, 5.0, 3.0);
const EMITTER: Vec3 = Vec3::new(3.1, 2.3, 1.9);

fn source(at: Vec3) -> Source {
    at.as_dvec3().to_array().into()
}

fn options(order: u32, length_s: f32) -> MeshOptions {
    MeshOptions {
        order,
        beams: 8192,
        rays: 6000,
        t30_within: None,
        length_s: Some(length_s),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    }
}

fn room(size: Vec3, absorption: [f32; 6], scattering: f32) -> (Mesh, Room) {
    let materials = absorption.map(|a| Material::even("wall", a, scattering));
    let walls = Shoebox { size: size.as_dvec3().to_array(), materials };
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    (mesh, room)
}

fn at(x: f32, y: f32, z: f32) -> Pose {
    Pose { position: Vec3::new(x, y, z), ..Pose::IDENTITY }
}

fn energy(samples: &[f32]) -> f64 {
    samples.iter().map(|v| f64::from(*v).powi(2)).sum()
}

fn simulate(room: &(Mesh, Room), emitter: Vec3, hrtf: &Hrtf, poses: &[Pose], options: &MeshOptions) -> Simulated {
    simulate_mesh(&room.0, &room.1, &source(emitter), hrtf, poses, options, |_| ()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_box_of_triangles_is_a_box() {
    let absorption = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let poses = [at(1.0, 1.0, 1.0), Pose::from_ypr(Vec3::new(5.2, 3.9, 1.4), 1.0, 0.2, 0.0)];
    let hrtf = two_sided();
    let walls = Shoebox { size: SIZE.as_dvec3().to_array(), materials: absorption.map(|a| Material::even("wall", a, 0.3)) };
    let options = MeshOptions { air: Some(Air::default()), ..options(6, 0.3) };
    // Images, scattering and air, all of it.
    let simulated = simulate(&room(SIZE, absorption, 0.3), EMITTER, &hrtf, &poses, &options);
    let exact = simulate_box(&walls, EMITTER, &hrtf, &poses, &options, |_| ()).unwrap().responses;
    for (a, b) in simulated.responses.responses.iter().zip(&exact.responses) {
        assert_eq!((a.listener, &a.name), (b.listener, &b.name));
        for (a, b) in [(&a.left, &b.left), (&a.right, &b.right)] {
            let difference: Vec<f32> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            let db = 10.0 * (energy(&difference) / energy(b)).log10();
            assert!(db < -60.0, "{db} dB of difference");
        }
    }
}

#[test]
fn a_room_that_scatters_decays_after_eyring_in_every_octave_alike() {
    let eyring = room(SIZE, [0.2; 6], 0.5).1.eyring_t60_s(Some(105.0), None)[3];
    let poses = [at(1.0, 1.0, 1.0), at(5.5, 1.5, 1.2)];
    let options = options(3, (1.2 * eyring) as f32);
    let simulated = simulate(&room(SIZE, [0.2; 6], 0.5), EMITTER, &transparent(), &poses, &options);
    for response in &simulated.responses.responses {
        let t20 = decay_time_s(&response.left, f64::from(RATE), DecayRange::T20).unwrap();
        assert!((t20 / eyring - 1.0).abs() < 0.12, "{t20} s for {eyring} s");
        // What is left at 0.1 s is that of a diffuse field, by and large.
        let late = energy(&response.left[2400..]);
        let decay = 6.0 * std::f64::consts::LN_10 / eyring;
        let diffuse = 4.0 * std::f64::consts::PI * 343.0 / 105.0 / decay * (-0.1 * decay).exp();
        assert!((10.0 * (late / diffuse).log10()).abs() < 1.5, "{late} for {diffuse}");
    }
}

#[test]
fn responses_are_as_long_as_the_room_sounds() {
    let options = MeshOptions { length_s: None, rays: 1000, ..options(1, 1.0) };
    let simulated = simulate(&room(SIZE, [0.2; 6], 0.5), EMITTER, &transparent(), &[at(1.0, 1.0, 1.0)], &options);
    let length = simulated.responses.responses[0].left.len() as f64 / f64::from(RATE);
    assert!((length / 0.55 - 1.0).abs() < 0.1, "{length} s");
}

#[test]
fn places_in_a_mesh_are_off_its_walls() {
    let (mesh, room) = room(Vec3::new(1.5, 18.0, 2.7), [0.2; 6], 0.4);
    let inside = Inside::new(&mesh, &room, Vec3::new(0.7, 2.0, 1.2), 0.4).unwrap();
    let places = grid(&inside, 1.0, 1.5).unwrap();
    assert!(places.len() == 18 && places.iter().all(|p| (p.x, p.z) == (0.75, 1.5) && inside.holds(*p)), "{places:?}");
    assert!(grid(&inside, 0.0001, 1.5).is_err() && grid(&inside, f32::NAN, 1.5).is_err());
    assert!(!inside.holds(Vec3::new(0.2, 9.0, 1.5)) && !inside.holds(Vec3::new(9.0, 9.0, 1.5)));
    let heads = random_inside(&inside, 20, 3).unwrap();
    assert!(heads.iter().all(|h| inside.holds(h.position)) && heads == random_inside(&inside, 20, 3).unwrap());
    let narrow = Inside::new(&mesh, &room, Vec3::new(0.7, 2.0, 1.2), 0.8).unwrap();
    assert!(random_inside(&narrow, 1, 3).is_err() && grid(&narrow, 1.0, 1.5).is_err());
    let turned = turned(&[Vec3::X, Vec3::Y], 4);
    let yaws: Vec<f32> = turned.iter().map(|p| p.ypr().0.to_degrees().round().rem_euclid(360.0)).collect();
    assert_eq!((turned[4].position, &yaws[..4]), (Vec3::Y, &[0.0, 90.0, 180.0, 270.0][..]));
}

#[test]
fn nothing_is_heard_before_the_direct_sound() {
    let simulated = simulate(&room(SIZE, [0.2; 6], 0.9), EMITTER, &transparent(), &[at(6.5, 4.5, 0.5)], &options(2, 0.2));
    let direct = EMITTER.distance(Vec3::new(6.5, 4.5, 0.5)) / SPEED_OF_SOUND_M_S * RATE as f32;
    let response = &simulated.responses.responses[0].left;
    let before = energy(&response[..direct as usize - 24]) / energy(response);
    assert!(before < 1e-5, "{before}");
}

#[test]
fn the_end_of_a_corridor_is_heard_from_its_side() {
    // Both ends take nearly all, so that late sound comes along the corridor from where the emitter is, to the left.
    let corridor = room(Vec3::new(30.0, 1.5, 2.5), [0.95, 0.95, 0.05, 0.05, 0.05, 0.05], 0.2);
    let pose = Pose::from_ypr(Vec3::new(27.0, 0.8, 1.3), std::f32::consts::FRAC_PI_2, 0.0, 0.0);
    let simulated = simulate(&corridor, Vec3::new(2.0, 0.7, 1.2), &two_sided(), &[pose], &options(0, 0.4));
    let response = &simulated.responses.responses[0];
    let late = (0.09 * RATE as f32) as usize;
    let ild = 10.0 * (energy(&response.left[late..]) / energy(&response.right[late..])).log10();
    assert!(ild > 2.0, "{ild} dB");
}

#[test]
fn a_seed_is_the_same_on_any_number_of_threads() {
    let room = room(SIZE, [0.2; 6], 0.4);
    let poses = [at(1.0, 1.0, 1.0), at(1.0, 1.0, 1.0), at(4.0, 4.0, 1.0)];
    let options = options(2, 0.1);
    let on = |threads: usize, options: &MeshOptions| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| simulate(&room, EMITTER, &transparent(), &poses, options).responses.responses)
    };
    let once = on(1, &options);
    assert_eq!(once, on(3, &options));
    assert_ne!(once, on(1, &MeshOptions { seed: 2, ..options }));
    assert_ne!(once[0].left, once[1].left, "each pose has noise of its own");
}

#[test]
fn what_cannot_be_is_an_error() {
    let room = room(SIZE, [0.2; 6], 0.4);
    let refused = |poses: &[Pose], options: &MeshOptions, says: &str| {
        let result = simulate_mesh(&room.0, &room.1, &source(EMITTER), &transparent(), poses, options, |_| ());
        let error = result.unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    };
    refused(&[at(1.0, 1.0, 1.0), at(3.1, 2.3, 1.95)], &options(2, 0.1), "pose 1");
    refused(&[at(1.0, 1.0, 1.0)], &options(2, 0.0), "length of the responses");
    refused(&[at(1.0, 1.0, 1.0)], &options(99, 0.1), "order of images: expected at most 50");
    refused(&[at(1.0, 1.0, 1.0)], &MeshOptions { rays: 0, ..options(2, 0.1) }, "rays");
}

#[test]
fn parts_are_bit_for_bit_what_the_whole_has() {
    let heads = turned(&[Vec3::new(1.0, 1.0, 1.0), Vec3::new(5.2, 3.9, 1.4), Vec3::new(2.0, 4.0, 1.1)], 2);
    let walls = room(SIZE, [0.3; 6], 0.3);
    for length_s in [Some(0.1), None] {
        let options = MeshOptions { length_s, rays: 600, ..options(2, 0.1) };
        let whole = simulate(&walls, EMITTER, &two_sided(), &heads, &options).responses.responses;
        let mut seen = 0;
        for number in 1..=2 {
            let part = Part { number, of: 2 };
            let made = simulate(&walls, EMITTER, &two_sided(), &heads, &MeshOptions { part, ..options });
            let expected: Vec<Response> = part.poses(&heads).into_iter().map(|i| whole[i].clone()).collect();
            assert_eq!(made.responses.responses, expected);
            seen += expected.len();
        }
        assert_eq!(seen, 6);
    }
}

#[test]
fn a_source_that_faces_away_is_heard_by_its_reflections() {
    let (mesh, room) = room(SIZE, [0.2; 6], 0.5);
    let listener = at(5.6, 2.3, 1.9);
    let of = |omni: f64, yaw: f64| {
        let directivity = Directivity::first_order(omni).turned(yaw, 0.0);
        let source = Source { directivity, ..source(EMITTER) };
        let made = simulate_mesh(&mesh, &room, &source, &transparent(), &[listener], &options(3, 0.3), |_| ()).unwrap();
        let left = made.responses.responses[0].left.clone();
        let direct = (2.5 / SPEED_OF_SOUND_M_S * RATE as f32) as usize;
        [energy(&left[direct - 20..direct + 20]), energy(&left[direct + 20..])]
    };
    let [everywhere, _] = of(1.0, 0.0);
    let [[towards, reflected], [away, room_away]] = [0.0, std::f64::consts::PI].map(|yaw| of(0.5, yaw));
    let db = |a: f64, b: f64| 10.0 * (a / b).log10();
    assert!(db(towards, everywhere).abs() < 0.05, "{} dB ahead", db(towards, everywhere));
    let [direct, rest] = [db(away, towards), db(room_away, reflected)];
    assert!(direct < -18.0 && rest.abs() < 3.0, "behind it the direct sound has {direct} dB, the room {rest} dB");
}

/// Materials that take or scatter nothing, everything, or anything between, each octave for itself.
fn any_material(random: &mut Random) -> Material {
    let mut share = || match (random.uniform() * 5.0) as u32 {
        0 => 0.0,
        1 => 1.0,
        2 => 0.99,
        _ => random.uniform(),
    };
    let octaves: [[f32; 7]; 2] = [(); 2].map(|()| std::array::from_fn(|_| share()));
    let even = share() < 0.3;
    let [absorption, scattering] = octaves.map(|octaves| if even { [octaves[0]; 7] } else { octaves });
    Material { absorption_63: (share() < 0.5).then_some(absorption[6]), ..Material::new("any", absorption, scattering) }
}

/// An L of random arms with a floor and a ceiling, a group for each surface.
fn any_room(random: &mut Random) -> Mesh {
    let mut side = |low: f64, high: f64| low + (high - low) * f64::from(random.uniform());
    let (x, y, height) = (side(4.0, 9.0), side(4.0, 9.0), side(2.0, 5.0));
    let (inner_x, inner_y) = (x * side(0.4, 0.7), y * side(0.4, 0.7));
    let plan = [[0.0, 0.0], [x, 0.0], [x, inner_y], [inner_x, inner_y], [inner_x, y], [0.0, y]];
    let vertices = [0.0, height].iter().flat_map(|z| plan.map(|[x, y]| [x, y, *z])).collect();
    let walls = (0..6).flat_map(|i| {
        let j = (i + 1) % 6;
        [[j, i, i + 6], [j, i + 6, j + 6]].map(|corners| Triangle { corners, group: i })
    });
    let caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let caps = caps.into_iter().flat_map(|[a, b, c]| [([a, b, c], 6), ([a + 6, c + 6, b + 6], 7)]);
    let caps = caps.map(|(corners, group)| Triangle { corners, group });
    Mesh { vertices, triangles: walls.chain(caps).collect(), groups: (0..8).map(|i| format!("{i}")).collect() }
}

/// Rooms that the property is looked for in, if `ROOMS` does not say how many.
const ANY_ROOMS: u64 = 120;

#[test]
fn rooms_of_any_materials_make_numbers() {
    let hrtf = transparent();
    let rooms = std::env::var("ROOMS").map_or(ANY_ROOMS, |rooms| rooms.parse().unwrap());
    for seed in 0..rooms {
        let mut random = Random::new(seed);
        let mesh = any_room(&mut random);
        let materials: Vec<Material> = mesh.groups.iter().map(|_| any_material(&mut random)).collect();
        let room = Room::new(&mesh, &materials).unwrap();
        let [low, high] = mesh.bounds().map(|corner| Vec3::from_array(corner.map(|c| c as f32)));
        let emitter = low + 0.25 * (high - low);
        let inside = Inside::new(&mesh, &room, emitter, 0.1).unwrap();
        let poses = random_inside(&inside, 2, seed).unwrap();
        let omni = [1.0, 0.5, 0.0][seed as usize % 3];
        let source = Source { directivity: Directivity::first_order(omni), ..source(emitter) };
        let waves_hz = (seed > 0).then_some(0.0);
        let of = MeshOptions { rays: 200, beams: 200, air: Some(Air::default()), waves_hz, ..options(2, 0.05) };
        let made = simulate_mesh(&mesh, &room, &source, &hrtf, &poses, &of, |_| ()).unwrap();
        let ears = made.responses.responses.iter().flat_map(|r| r.left.iter().chain(&r.right));
        assert!(ears.into_iter().all(|v| v.is_finite()), "responses of seed {seed}");
        if seed % 20 < 2 {
            let options = crate::geometry::GeometryOptions {
                images: 10,
                head_turns: 1,
                order: 2,
                beams: 200,
                rays: 200,
                spacing_m: 0.9,
                height_m: 1.5,
                layered: false,
                margin_m: 0.3,
                air: Some(Air::default()),
                waves_hz,
                gain_db: 0.0,
                seed: 1,
                title: String::new(),
                recipe: String::new(),
            };
            let scene = crate::geometry::bake_geometry(&mesh, &room, &source, &hrtf, &options, |_| ());
            // What a scene has is checked as it is made.
            assert!(scene.is_ok(), "scene of seed {seed}: {:?}", scene.err());
        }
    }
}
