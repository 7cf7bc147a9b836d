use super::*;
use crate::sources::simulation::heads::{RATE, transparent, two_sided};
use crate::sources::simulation::{MeshOptions, Part, simulate_box, simulate_mesh};
use promenade_acoustics::{Air, Directivity, Images, Material, Octaves, Reflected, SPEED_OF_SOUND_M_S, Shoebox, fibonacci};
use promenade_core::glam::{DVec2, DVec3};
use promenade_core::{Bands, Pose};
use promenade_metrics::{DecayRange, decay_time_s};
use promenade_player::render_response;
use promenade_room::{SceneOptions, ShoeboxRoom};
use std::path::Path;
use std::sync::Arc;

const SIZE: [f64; 3] = [7.0, 5.0, 3.0];
/// Draws of noise whose mean is measured.
const SEEDS: u64 = 4;
/// Samples before the direct sound, and samples that it is over in.
const LEAD: usize = 48;
const DIRECT: usize = 2 * LEAD;
const EMITTER: Vec3 = Vec3::new(2.1, 2.3, 1.4);

fn source(at: Vec3) -> Source {
    at.as_dvec3().to_array().into()
}

fn room(absorption: f32, scattering: f32) -> (Mesh, Room) {
    let materials = [(); 6].map(|()| Material::even("wall", absorption, scattering));
    let walls = Shoebox { size: SIZE, materials };
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    (mesh, room)
}

fn options(images: usize, rays: usize) -> GeometryOptions {
    GeometryOptions {
        images,
        head_turns: 6,
        order: 4,
        beams: 4096,
        rays,
        spacing_m: 1.2,
        height_m: 1.5,
        layered: false,
        margin_m: 0.4,
        air: None,
        waves_hz: Some(0.0),
        gain_db: 0.0,
        seed: 1,
        title: "Box".to_owned(),
        recipe: String::new(),
    }
}

fn energy(samples: &[f32]) -> f64 {
    samples.iter().map(|v| f64::from(*v).powi(2)).sum()
}

/// Responses of the scene and of the room itself at a place between the nodes, from [`LEAD`] before the direct sound on.
fn both([absorption, scattering]: [f32; 2], images: usize, rays: usize, at: Vec3, length_s: f32) -> [Vec<f32>; 2] {
    let (mesh, room) = room(absorption, scattering);
    let hrtf = transparent();
    let scene = bake_geometry(&mesh, &room, &source(EMITTER), &hrtf, &options(images, rays), |_| ()).unwrap();
    let pose = Pose { position: at, ..Pose::IDENTITY };
    let length = (f64::from(length_s) * f64::from(RATE)) as usize;
    let [heard, _] = render_response(&Arc::new(scene), pose, LEAD, length).unwrap();
    let options = MeshOptions {
        order: 4,
        beams: 4096,
        rays,
        t30_within: None,
        length_s: Some(length_s + 0.1),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    let truth = simulate_mesh(&mesh, &room, &source(EMITTER), &hrtf, &[pose], &options, |_| ()).unwrap();
    let direct = (f64::from(at.distance(EMITTER)) / SPEED_OF_SOUND_M_S * f64::from(RATE)).round() as usize;
    let left = truth.responses.responses[0].left[direct - LEAD..][..length].to_vec();
    [heard, left]
}

#[test]
fn early_reflections_of_a_scene_are_those_of_its_room() {
    // Walls that scatter nothing: 30 ms of images alone.
    let [heard, truth] = both([0.5, 0.0], 200, 500, Vec3::new(4.9, 3.3, 1.6), 0.03);
    let gain = (energy(&heard[..DIRECT]) / energy(&truth[..DIRECT])).sqrt();
    // Within a millisecond each, after the direct sound.
    let hop = RATE as usize / 500;
    let level = |x: &[f32]| 10.0 * energy(x).max(1e-9).log10();
    let pairs = heard.chunks(hop).zip(truth.chunks(hop)).skip(DIRECT / hop);
    let errors: Vec<f64> = pairs.map(|(h, t)| (level(h) - 20.0 * gain.log10() - level(t)).powi(2)).collect();
    let rms = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
    assert!(rms < 1.2, "{rms} dB");
}

#[test]
fn an_emitter_that_faces_away_is_quieter_than_its_room() {
    let (mesh, room) = room(0.3, 0.2);
    let (ahead, behind) = (Vec3::new(4.5, 2.3, 1.5), Vec3::new(0.9, 2.3, 1.5));
    let cardioid = Source { directivity: Directivity::first_order(0.5), ..source(EMITTER) };
    let [directive, omni] = [cardioid, source(EMITTER)].map(|source| {
        let scene = bake_geometry(&mesh, &room, &source, &transparent(), &options(40, 4000), |_| ()).unwrap();
        assert_eq!(scene.images().unwrap().emission.is_none(), source.directivity.is_omni());
        Arc::new(scene)
    });
    let heard = |scene: &Arc<Scene>, position: Vec3| {
        let [left, _] = render_response(scene, Pose { position, ..Pose::IDENTITY }, LEAD, RATE as usize / 2).unwrap();
        [energy(&left[..DIRECT]), energy(&left[DIRECT..])]
    };
    let db = |a: f64, b: f64| 10.0 * (a / b).log10();
    // Beside a source that sends the same everywhere: direct sound over the room's.
    let ratio = |at: Vec3| {
        let [[direct, room], [direct_omni, room_omni]] = [&directive, &omni].map(|scene| heard(scene, at));
        db(direct, room) - db(direct_omni, room_omni)
    };
    let (ahead, behind) = (ratio(ahead), ratio(behind));
    assert!((3.0..7.0).contains(&ahead), "{ahead} dB more direct sound ahead: the room has a third of the energy");
    assert!(behind < -11.0, "{behind} dB behind");
}

/// Level of samples about a frequency, dB.
fn level_db(samples: &[f32], hz: f64) -> f64 {
    let energy = |hz: f64| {
        let turn = std::f64::consts::TAU * hz / f64::from(RATE);
        let parts = samples.iter().enumerate().map(|(n, x)| {
            let (sin, cos) = (turn * n as f64).sin_cos();
            DVec2::new(cos, sin) * f64::from(*x)
        });
        parts.sum::<DVec2>().length_squared()
    };
    10.0 * [0.85, 1.0, 1.15].map(|by| energy(by * hz)).iter().sum::<f64>().max(1e-20).log10()
}

#[test]
fn direct_sound_and_images_have_the_colour_of_their_direction() {
    // The wall behind the emitter reflects all, the others nothing.
    let mut walls = Shoebox { size: SIZE, materials: [(); 6].map(|()| Material::even("open", 1.0, 0.0)) };
    walls.materials[0] = Material::even("wall", 0.0, 0.0);
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    // It faces away from that wall and beams the more the higher the octave.
    let amplitudes = |towards: [f64; 3]| -> Octaves {
        let aside = 0.5 * (1.0 - towards[0]);
        std::array::from_fn(|octave| (1.0 - 0.13 * octave as f64 * aside) as f32)
    };
    let given: Vec<_> = (0..600).map(|i| fibonacci(i, 600)).map(|towards| (towards, amplitudes(towards))).collect();
    let beamed = Source { directivity: Directivity::measured(&given).unwrap(), ..source(EMITTER) };
    let hrtf = transparent();
    let scene = Arc::new(bake_geometry(&mesh, &room, &beamed, &hrtf, &options(1, 100), |_| ()).unwrap());
    assert!(Scene::from_bytes(&scene.to_bytes().unwrap()).unwrap() == *scene);
    let truth = MeshOptions {
        order: 1,
        beams: 1024,
        rays: 100,
        t30_within: None,
        length_s: Some(0.1),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    let mut axis_db = None;
    for at in [Vec3::new(5.0, 2.3, 1.5), Vec3::new(3.6, 4.2, 1.5), Vec3::new(2.2, 4.4, 1.5), Vec3::new(0.7, 3.3, 1.5)] {
        let pose = Pose { position: at, ..Pose::IDENTITY };
        let [heard, _] = render_response(&scene, pose, LEAD, 1500).unwrap();
        let made = simulate_mesh(&mesh, &room, &beamed, &hrtf, &[pose], &truth, |_| ()).unwrap();
        let samples = |metres: f32| (f64::from(metres) / SPEED_OF_SOUND_M_S * f64::from(RATE)).round() as usize;
        let direct = samples(at.distance(EMITTER));
        let image = samples(at.distance(EMITTER * Vec3::new(-1.0, 1.0, 1.0)));
        for (name, arrival) in [("direct sound", direct), ("image", image)] {
            let near = LEAD.min((image - direct) / 2);
            let heard = &heard[LEAD + arrival - direct - near..][..2 * near];
            let made = &made.responses.responses[0].left[arrival - near..][..2 * near];
            for hz in [1000.0, 2000.0, 4000.0, 7000.0] {
                let off = level_db(heard, hz) - level_db(made, hz);
                let axis = *axis_db.get_or_insert(off);
                assert!((off - axis).abs() < 1.0, "{name} at {at}, {hz} Hz: {:.2} dB", off - axis);
            }
        }
    }
}

#[test]
fn the_ear_at_the_wall_that_swallows_hears_less_of_the_room() {
    let mut walls = Shoebox { size: SIZE, materials: [(); 6].map(|()| Material::even("wall", 0.1, 0.3)) };
    walls.materials[0] = Material::even("open", 1.0, 0.0);
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    let hrtf = two_sided();
    let scene = Arc::new(bake_geometry(&mesh, &room, &source(EMITTER), &hrtf, &options(4, 20_000), |_| ()).unwrap());
    let position = Vec3::new(0.8, 2.5, 1.5);
    let length = RATE as usize / 4;
    let truth = MeshOptions {
        order: 4,
        beams: 4096,
        rays: 20_000,
        t30_within: None,
        length_s: Some(0.4),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    for (yaw, name) in [(0.5 * PI, "left"), (-0.5 * PI, "right"), (0.0, "neither")] {
        let pose = Pose::from_ypr(position, yaw, 0.0, 0.0);
        let heard = render_response(&scene, pose, LEAD, length).unwrap();
        let made = simulate_mesh(&mesh, &room, &source(EMITTER), &hrtf, &[pose], &truth, |_| ()).unwrap();
        let direct = (f64::from(position.distance(EMITTER)) / SPEED_OF_SOUND_M_S * f64::from(RATE)).round() as usize;
        // From 30 ms after the direct sound on.
        let later = LEAD + 3 * RATE as usize / 100;
        let ild = |[left, right]: [&[f32]; 2]| 10.0 * (energy(left) / energy(right)).log10();
        let found = ild([&heard[0][later..], &heard[1][later..]]);
        let one = &made.responses.responses[0];
        let want = ild([&one.left, &one.right].map(|ear| &ear[direct - LEAD + later..][..length - later]));
        assert!((found - want).abs() < 0.7, "{name} ear at the wall: {found} dB, the room has {want} dB");
        assert!(name == "neither" || found.abs() > 0.7 && found.signum() == want.signum(), "{name}: {found}, {want}");
    }
}

#[test]
fn few_images_and_many_leave_the_room_its_energy_and_its_decay() {
    let at = Vec3::new(4.9, 3.3, 1.6);
    let mut found = Vec::new();
    for images in [6, 80] {
        let [heard, truth] = both([0.2, 0.2], images, 4000, at, 0.5);
        let gain = energy(&heard[..DIRECT]) / energy(&truth[..DIRECT]);
        let db = 10.0 * (energy(&heard[DIRECT..]) / energy(&truth[DIRECT..]) / gain).log10();
        let rate = f64::from(RATE);
        let [t20, want] = [&heard, &truth].map(|x| decay_time_s(x, rate, DecayRange::T20).unwrap());
        assert!(db.abs() < 1.0, "{images} images: {db} dB");
        assert!((t20 / want - 1.0).abs() < 0.1, "{images} images: {t20} s, {want} s");
        found.push(heard);
    }
    assert_ne!(found[0], found[1]);
}

#[test]
fn a_box_without_its_mesh_is_heard_as_with_it() {
    let absorption = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35];
    let mut walls = Shoebox { size: SIZE, materials: [(); 6].map(|()| Material::even("wall", 0.2, 0.1)) };
    walls.materials.iter_mut().for_each(|m| m.absorption = absorption);
    walls.materials[4].absorption = [0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5];
    let mesh = walls.mesh().unwrap();
    let room = Room::new(&mesh, &walls.materials).unwrap();
    let hrtf = transparent();
    let with_air = GeometryOptions { order: 6, air: Some(Air::default()), ..options(60, 20_000) };
    let baked = bake_geometry(&mesh, &room, &source(EMITTER), &hrtf, &with_air, |_| ()).unwrap();
    let drawn = ShoeboxRoom { walls, corner: Vec3::ZERO, emitter: EMITTER };
    let head = scene_head(&hrtf).unwrap();
    // Its noise is that of its seed, where a mesh's is chosen.
    let drawn = (1..=SEEDS).map(|seed| {
        let options = SceneOptions {
            images: 60,
            air: Air::default(),
            waves_hz: Some(0.0),
            layer_m: None,
            gain_db: 0.0,
            seed,
            title: String::new(),
            recipe: String::new(),
        };
        Arc::new(drawn.scene(&head, &options).unwrap())
    });
    let (baked, drawn) = (Arc::new(baked), drawn.collect::<Vec<_>>());
    let rate = f64::from(RATE);
    let mut sums = [0.0; 3];
    let places = [Vec3::new(4.9, 3.3, 1.5), Vec3::new(6.2, 0.9, 1.5), Vec3::new(1.0, 4.1, 1.5), Vec3::new(3.4, 1.2, 1.5)];
    for at in places {
        let measured = |scene: &Arc<Scene>| {
            let pose = Pose { position: at, ..Pose::IDENTITY };
            let [left, _] = render_response(scene, pose, LEAD, RATE as usize).unwrap();
            let direct = energy(&left[..DIRECT]);
            let early = energy(&left[DIRECT..LEAD + RATE as usize / 20]) / direct;
            let late = energy(&left[LEAD + RATE as usize / 20..]) / direct;
            let t20 = decay_time_s(&left, rate, DecayRange::T20).unwrap();
            [10.0 * (early + late).log10(), 10.0 * ((1.0 + early) / late).log10(), t20]
        };
        let baked = measured(&baked);
        for scene in &drawn {
            let drawn = measured(scene);
            println!("{at}: level, dB, C50, dB, T20, s: scene of the mesh {baked:.3?}, of the box {drawn:.3?}");
            let off = [drawn[0] - baked[0], drawn[1] - baked[1], drawn[2] / baked[2] - 1.0];
            sums.iter_mut().zip(off).for_each(|(sum, off)| *sum += off / (places.len() as f64 * SEEDS as f64));
        }
    }
    let [level, c50, t20] = sums;
    assert!(level.abs() < 0.5 && c50.abs() < 0.5 && t20.abs() < 0.1, "level {level:+.2} dB, C50 {c50:+.2} dB, T20 {t20:+.3}");
}

/// Mean energy of all places about a frequency, over some hops after the direct sound.
fn mean(late: &[LateEnergies], bands: &Bands, hz: f32, hops: std::ops::Range<usize>) -> f64 {
    let near = |i: &usize| (bands.centres_hz()[*i] - hz).abs();
    let band = (0..bands.count()).min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
    let one = |late: &LateEnergies| late.energies.iter().take(hops.end).skip(hops.start).map(|hop| hop[band]).sum::<f64>();
    late.iter().map(one).sum::<f64>() / late.len() as f64
}

#[test]
fn a_box_is_one_room_as_lengths_as_mesh_and_drawn() {
    let mut walls = Shoebox { size: SIZE, materials: [(); 6].map(|()| Material::even("wall", 0.2, 0.4)) };
    walls.materials[4].absorption = [0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5];
    walls.materials[5].scattering = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7];
    let mesh = walls.mesh().unwrap();
    let (room, hrtf, air) = (Room::new(&mesh, &walls.materials).unwrap(), transparent(), Some(Air::default()));
    let head = scene_head(&hrtf).unwrap();
    // All images are played, so that the rest is what walls scatter.
    let with_air = GeometryOptions { order: 6, air, ..options(400, 30_000) };
    let meshed = surfaces(&mesh, &room, &source(EMITTER), (&hrtf, &head), &with_air, |_| ()).unwrap();
    let options = SceneOptions {
        images: 400,
        air: Air::default(),
        waves_hz: Some(0.0),
        layer_m: None,
        gain_db: 0.0,
        seed: 1,
        title: String::new(),
        recipe: String::new(),
    };
    let drawn = ShoeboxRoom { walls: walls.clone(), corner: Vec3::ZERO, emitter: EMITTER }.surfaces(&head, &options).unwrap();
    let place = meshed.places.at[7];
    let lengths = Images::of_box(&walls, source(EMITTER), 6).unwrap();
    let lengths = lengths.seen_from(&room, place.to_array(), Reflected::Specular).unwrap();
    assert_eq!((meshed.played.images.len(), drawn.played.images.len(), lengths.len()), (376, 376, 377));
    for image in &drawn.played.images {
        let nearest = |all: &mut dyn Iterator<Item = (DVec3, Octaves)>| {
            let near = |at: &DVec3| at.distance(image.position);
            all.min_by(|a, b| near(&a.0).total_cmp(&near(&b.0))).unwrap()
        };
        let of_mesh = nearest(&mut meshed.played.images.iter().map(|image| (image.position, image.gains)));
        let of_lengths = nearest(&mut lengths.iter().map(|image| (image.position.into(), image.gains)));
        for (position, gains) in [of_mesh, of_lengths] {
            assert!(position.distance(image.position) / SPEED_OF_SOUND_M_S < 1e-6, "{position} for {}", image.position);
            for (found, expected) in gains.iter().zip(image.gains) {
                assert!((20.0 * (found / expected).log10()).abs() < 0.01, "{gains:?} for {:?}", image.gains);
            }
        }
    }
    let poses: Vec<Pose> = meshed.places.at.iter().map(|at| Pose { position: at.as_vec3(), ..Pose::IDENTITY }).collect();
    let rays = MeshOptions {
        order: 6,
        beams: 0,
        rays: 30_000,
        t30_within: None,
        length_s: Some(0.7),
        air,
        waves_hz: Some(0.0),
        seed: 2,
        part: Part::WHOLE,
    };
    let simulated = simulate_box(&walls, EMITTER, &hrtf, &poses, &rays, |_| ()).unwrap();
    // One place after another, which parts of a simulation sort.
    let mut places = meshed.places.at.clone();
    places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let direct_s = |at: &DVec3| at.distance(EMITTER.as_dvec3()) / SPEED_OF_SOUND_M_S;
    let late = simulated.late.echograms.iter().zip(&places).map(|(e, at)| LateEnergies::of(e, direct_s(at), &head));
    let late: Vec<LateEnergies> = late.collect();
    for (hops, within) in [(1..20, 0.5), (20..40, 0.5), (40..80, 0.5)] {
        for hz in [250.0, 1000.0, 4000.0] {
            let [drawn, meshed, lengths] =
                [&drawn.late, &meshed.late, &late].map(|late| mean(late, head.bands(), hz, hops.clone()));
            let off = [meshed, lengths].map(|other| 10.0 * (other / drawn).log10());
            println!("hops {hops:?}, {hz} Hz: mesh {:+.2} dB, lengths {:+.2} dB of the drawn room's", off[0], off[1]);
            assert!(off.iter().all(|db| db.abs() < within), "hops {hops:?}, {hz} Hz: {off:?} dB");
        }
    }
}

#[test]
fn a_room_without_a_place_for_the_listener_is_refused() {
    let (mesh, room) = room(0.3, 0.1);
    let narrow = GeometryOptions { margin_m: 2.0, ..options(10, 100) };
    let error = bake_geometry(&mesh, &room, &source(EMITTER), &transparent(), &narrow, |_| ()).unwrap_err().to_string();
    assert!(error.contains("places of the listener"), "{error}");
    let dense = GeometryOptions { spacing_m: 0.01, ..options(10, 100) };
    let error = bake_geometry(&mesh, &room, &source(EMITTER), &transparent(), &dense, |_| ()).unwrap_err().to_string();
    assert!(error.contains("at most 4096"), "{error}");
}

#[test]
fn the_outline_has_the_edges_of_walls_and_not_of_triangles() {
    let (mesh, _) = room(0.3, 0.2);
    let points = outline(&edges(&mesh), EMITTER);
    let size = Vec3::from_array(SIZE.map(|length| length as f32));
    let (emitter, walls) = points.split_last().unwrap();
    assert_eq!(emitter.position, EMITTER);
    let at_walls = |p: Vec3| (0..3).filter(|&i| p[i].abs() < 1e-4 || (p[i] - size[i]).abs() < 1e-4).count();
    assert!(walls.iter().all(|anchor| at_walls(anchor.position) >= 2), "a point within a wall");
    // Twelve edges, a point every 25 cm.
    let expected = 4.0 * (size.x + size.y + size.z) / 0.25 + 12.0;
    assert!((walls.len() as f32 - expected).abs() < 2.0, "{} points, not {expected}", walls.len());
}

#[test]
fn the_emitter_fades_at_the_border_of_the_geometry_and_is_heard_round_the_corner() {
    // An L whose walls swallow nearly all: what arrives is the direct sound, or what comes round the corner at (5, 4.5).
    let loft = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../presets/library/l-shaped-loft.obj");
    let mesh = Mesh::load(&loft).unwrap();
    let walls: Vec<Material> = mesh.groups.iter().map(|_| Material::even("open", 0.98, 0.0)).collect();
    let room = Room::new(&mesh, &walls).unwrap();
    let emitter = Vec3::new(2.4, 7.6, 1.5);
    let hrtf = transparent();
    let options = GeometryOptions { height_m: 1.5, head_turns: 1, ..options(4, 500) };
    let scene = Arc::new(bake_geometry(&mesh, &room, &source(emitter), &hrtf, &options, |_| ()).unwrap());
    let bytes = scene.to_bytes().unwrap();
    let again = Scene::from_bytes(&bytes).unwrap();
    assert!(again.corners().is_some() && again.corners() == scene.corners() && again.to_bytes().unwrap() == bytes);
    let truth = MeshOptions {
        order: 1,
        beams: 1024,
        rays: 500,
        t30_within: None,
        length_s: Some(0.1),
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    let (lead, length) = (LEAD + 48, 512);
    // The border of its shadow is at x = 5 + 2.6 * 1.9 / 3.1 = 6.59 m.
    let mut gains = Vec::new();
    for x in [5.6, 6.3, 6.75, 7.2, 8.0, 10.0] {
        let pose = Pose::from_ypr(Vec3::new(x, 2.6, 1.5), 0.3, 0.0, 0.0);
        let heard = render_response(&scene, pose, lead, length).unwrap();
        let made = simulate_mesh(&mesh, &room, &source(emitter), &hrtf, &[pose], &truth, |_| ()).unwrap();
        let direct_m = pose.position.distance(emitter);
        let corner = Vec3::new(5.0, 4.5, 1.5);
        let way_m = emitter.distance(corner) + corner.distance(pose.position);
        let detour_m = if x < 6.59 { 0.0 } else { way_m - direct_m };
        let samples = |metres: f32| f64::from(metres) / SPEED_OF_SOUND_M_S * f64::from(RATE);
        // Within 0.6 ms of the arrival, before the floor's reflection, what it has and when.
        let part = |x: &[f32], arrival: f64| {
            let from = (arrival - 0.0006 * f64::from(RATE)).round();
            let part = &x[from as usize..][..(0.0012 * f64::from(RATE)) as usize];
            let at = part.iter().enumerate().map(|(i, v)| i as f64 * f64::from(*v).powi(2)).sum::<f64>();
            (energy(part), at / energy(part) + from - arrival)
        };
        let (ear, at) = part(&heard[0], lead as f64 + samples(detour_m));
        let (truth, truth_at) = part(&made.responses.responses[0].left, samples(direct_m + detour_m));
        gains.push((x, 10.0 * (ear / truth).log10(), (at - truth_at) / f64::from(RATE)));
    }
    // Against the place where the emitter is seen.
    let seen = gains[0].1;
    for (x, gain, late_s) in gains {
        assert!((gain - seen).abs() < 1.0 && late_s.abs() < 20e-6, "x = {x}: {:.2} dB, {late_s} s", gain - seen);
    }
}

#[test]
fn a_corrected_room_has_what_its_responses_have() {
    let (mesh, room) = room(0.3, 0.2);
    let (hrtf, options, source) = (transparent(), options(40, 4000), source(EMITTER));
    let poses: Vec<Pose> = [(1.0, 1.0), (5.5, 1.2), (5.8, 4.0), (1.3, 4.1), (3.6, 2.6)]
        .map(|(x, y)| Pose { position: Vec3::new(x, y, 1.5), ..Pose::IDENTITY })
        .to_vec();
    let of = MeshOptions {
        order: 4,
        beams: 4096,
        rays: 4000,
        t30_within: None,
        length_s: None,
        air: None,
        waves_hz: Some(0.0),
        seed: 1,
        part: Part::WHOLE,
    };
    let made = simulate_mesh(&mesh, &room, &source, &hrtf, &poses, &of, |_| ()).unwrap().responses.responses;
    // All is twice as loud, but for what comes later than the direct sound.
    let corrected = |later: f32| {
        let one = |r: &crate::Response| {
            let after =
                ((f64::from(r.listener.position.distance(EMITTER)) / SPEED_OF_SOUND_M_S + 0.004) * f64::from(RATE)) as usize;
            let ear =
                |x: &[f32]| x.iter().enumerate().map(|(i, v)| if i < after { 2.0 * v } else { 2.0 * later * v }).collect();
            let simulated = [r.left.clone(), r.right.clone()];
            CorrectedResponse { at: r.listener.position, corrected: [ear(&r.left), ear(&r.right)], simulated }
        };
        let responses: Vec<CorrectedResponse> = made.iter().map(one).collect();
        let scene =
            bake_corrected((&mesh, &room, &source), &hrtf, &options, (&responses, false), Provenance::default()).unwrap();
        let pose = Pose { position: Vec3::new(4.6, 3.2, 1.5), ..Pose::IDENTITY };
        let [left, _] = render_response(&Arc::new(scene), pose, LEAD, RATE as usize / 2).unwrap();
        let late = RATE as usize / 12;
        [energy(&left[..DIRECT]), energy(&left[2 * DIRECT..late]), energy(&left[late..])]
    };
    let [[direct, early, late], [direct_less, early_less, late_less]] = [1.0, 0.5].map(corrected);
    let db = |a: f64, b: f64| 10.0 * (a / b).log10();
    let less = [db(early_less, early), db(late_less, late)].map(|x| x - db(direct_less, direct));
    assert!(less.iter().all(|x| (x + 6.02).abs() < 0.5), "{less:?}");
    // What is corrected has the room's bass where it is asked for, and its level.
    let responses = [CorrectedResponse {
        at: made[0].listener.position,
        simulated: [made[0].left.clone(), made[0].right.clone()],
        corrected: [&made[0].left, &made[0].right].map(|ear| ear.iter().map(|v| 2.0 * v).collect()),
    }];
    let bass = |waves_hz: Option<f64>, is_levelled: bool| {
        let options = GeometryOptions { waves_hz, ..options.clone() };
        let scene = bake_corrected((&mesh, &room, &source), &hrtf, &options, (&responses, is_levelled), Provenance::default());
        scene.unwrap().bass().map(|bass| bass.direct)
    };
    assert_eq!(bass(Some(0.0), true), None);
    let [plain, levelled] = [false, true].map(|is_levelled| bass(Some(80.0), is_levelled).unwrap());
    assert!((levelled / plain - 2.0).abs() < 0.05, "{levelled} for {plain}");
    // Its noise differs between the ears in phase, and its bass is that of several heights where that is asked for.
    for layered in [false, true] {
        let options = GeometryOptions { waves_hz: Some(80.0), layered, ..options.clone() };
        let about = Provenance::default();
        let scene = bake_corrected((&mesh, &room, &source), &hrtf, &options, (&responses, true), about).unwrap();
        let heights = scene.bass().unwrap().places[2].count();
        assert!(scene.tail().by_phase && (heights > 1) == layered, "{heights} heights");
    }
    let error =
        bake_corrected((&mesh, &room, &source), &hrtf, &options, (&[], false), Provenance::default()).unwrap_err().to_string();
    assert!(error.contains("one or more"), "{error}");
}
