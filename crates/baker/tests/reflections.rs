//! Rooms whose lengths are stated: early reflections keep their places while the listener walks.

use promenade_acoustics::{Material, Shoebox};
use promenade_baker::simulation::{Hrtf, MeshOptions, Part, simulate_box};
use promenade_baker::{BakeOptions, Response, Responses, Walls, bake_responses};
use promenade_core::glam::Vec3;
use promenade_core::head::lattice;
use promenade_core::{Head, Mover, Pose, Scene};
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::signal;
use promenade_player::render_response;
use std::sync::Arc;

const RATE: u32 = 16_000;
const SIZE: Vec3 = Vec3::new(6.0, 4.5, 2.8);
const LISTENER: Vec3 = Vec3::new(3.2, 2.0, 1.5);
const DISTANCE_M: f32 = 1.5;

/// The head that is built in.
pub(crate) fn head() -> Head {
    Head::from_bytes(include_bytes!("../data/kemar.head")).unwrap()
}

/// The same as measured responses.
pub(crate) fn hrtf(directions: usize, rate: u32) -> Hrtf {
    let (head, n_fft, lead) = (head(), 512, 40);
    let response = |i: usize| {
        let direction = lattice(i, directions);
        let [left, right] = head.ears(direction).spectra(n_fft, f64::from(rate)).map(|mut spectrum| {
            for (k, x) in spectrum.iter_mut().enumerate() {
                *x *= Complex32::from_polar(1.0, -std::f32::consts::TAU * (k * lead) as f32 / n_fft as f32);
            }
            signal(spectrum, n_fft)[..256].to_vec()
        });
        Response { listener: Pose::IDENTITY, source: 1.4 * direction, left, right, name: i.to_string() }
    };
    let set = Responses {
        sample_rate_hz: f64::from(rate),
        responses: (0..directions).map(response).collect(),
        ..Responses::default()
    };
    Hrtf::new(&set, rate).unwrap()
}

/// What is heard of a source in the box.
fn simulated(hrtf: &Hrtf, source: Vec3, poses: &[Pose]) -> Vec<Response> {
    simulated_by(500, hrtf, source, poses)
}

/// The same with some number of rays.
pub(crate) fn simulated_by(rays: usize, hrtf: &Hrtf, source: Vec3, poses: &[Pose]) -> Vec<Response> {
    let materials = [0.35, 0.15, 0.2, 0.3, 0.4, 0.25].map(|absorption| Material::even("wall", absorption, 0.1));
    let walls = Shoebox { size: SIZE.as_dvec3().to_array(), materials };
    let options = MeshOptions {
        order: 8,
        beams: 0,
        rays,
        t30_within: None,
        length_s: Some(0.4),
        air: None,
        waves_hz: Some(0.0),
        seed: 3,
        part: Part::WHOLE,
    };
    simulate_box(&walls, source, hrtf, poses, &options, |_| ()).unwrap().responses.responses
}

fn direction(azimuth_deg: f32) -> Vec3 {
    let a = azimuth_deg.to_radians();
    Vec3::new(a.cos(), a.sin(), 0.0)
}

fn at(position: Vec3, yaw_deg: f32) -> Pose {
    Pose::from_ypr(position, yaw_deg.to_radians(), 0.0, 0.0)
}

fn walls(moves: Option<Mover>) -> Option<Walls> {
    Some(Walls { corner: Vec3::ZERO, size: SIZE, moves })
}

fn bake(responses: Vec<Response>, room: Option<Walls>) -> Arc<Scene> {
    let set = Responses { sample_rate_hz: f64::from(RATE), responses, room, ..Responses::default() };
    Arc::new(bake_responses(&set, |_, _| false, &BakeOptions { head: Some(head()), ..BakeOptions::default() }).unwrap())
}

/// Both ears from the direct sound on, as a scene has it.
fn heard(scene: &Arc<Scene>, pose: Pose) -> [Vec<f32>; 2] {
    render_response(scene, pose, 800, 4_800).unwrap()
}

/// Energy in steps of 1 ms from 3 to 20 ms after an onset, dB, `[ear][step]`.
fn echogram(ears: [&[f32]; 2]) -> Vec<f64> {
    let peak = ears.iter().flat_map(|ear| ear.iter()).fold(0.0_f32, |a, v| a.max(v.abs()));
    let onset = ears.iter().filter_map(|ear| ear.iter().position(|v| v.abs() > 0.1 * peak)).min().unwrap();
    let step = RATE as usize / 1000;
    let energy = |part: &[f32]| 10.0 * (part.iter().map(|v| f64::from(v * v)).sum::<f64>() + 1e-9).log10();
    ears.iter().flat_map(|ear| ear[onset + 3 * step..onset + 20 * step].chunks(step).map(energy)).collect()
}

/// How far echograms of a scene are off, dB rms, over all poses with one level.
fn off_db(scene: &Arc<Scene>, truth: &[(Pose, Response)]) -> f64 {
    let differences: Vec<f64> = truth
        .iter()
        .flat_map(|(pose, response)| {
            let [left, right] = heard(scene, *pose);
            let (a, b) = (echogram([&left, &right]), echogram([&response.left, &response.right]));
            a.into_iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>()
        })
        .collect();
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / differences.len() as f64).sqrt()
}

/// How much of a response is missed at its pose in the first 50 ms, dB, at the best gain and time.
fn missed_db(scene: &Arc<Scene>, pose: Pose, response: &Response) -> f64 {
    let heard = heard(scene, pose);
    let wanted = [&response.left, &response.right];
    let at_lag = |lag: usize| {
        let pairs = wanted.iter().zip(&heard).flat_map(|(w, h)| w[..1000].iter().zip(&h[lag..]));
        pairs.fold([0.0_f64; 3], |[a, b, c], (w, h)| [a + f64::from(w * h), b + f64::from(h * h), c + f64::from(w * w)])
    };
    let [cross, own, energy] = (500..800).map(at_lag).max_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
    10.0 * ((1.0 - cross * cross / (own * energy)).max(1e-12)).log10()
}

#[test]
fn a_source_of_a_room_with_lengths_is_walked_round_and_a_measured_pose_stays_exact() {
    let (hrtf, source) = (hrtf(600, RATE), LISTENER + DISTANCE_M * direction(20.0));
    let turned: Vec<Pose> = (0..24).map(|i| at(LISTENER, 15.0 * i as f32)).collect();
    let measured = simulated(&hrtf, source, &turned);
    let walked: Vec<Pose> = [(1.0, 0.0, 30.0), (-0.8, 0.6, -40.0), (-1.2, -0.7, 100.0), (0.3, 1.2, -100.0)]
        .map(|(x, y, yaw)| at(LISTENER + Vec3::new(x, y, 0.0), yaw))
        .to_vec();
    let truth: Vec<(Pose, Response)> = walked.iter().copied().zip(simulated(&hrtf, source, &walked)).collect();
    let (plain, room) = (bake(measured.clone(), None), bake(measured.clone(), walls(None)));
    let (before, after) = (off_db(&plain, &truth), off_db(&room, &truth));
    println!("walking: {before:.2} dB without lengths, {after:.2} dB with them");
    for (i, response) in measured.iter().enumerate().step_by(5) {
        let missed = [&plain, &room].map(|scene| missed_db(scene, turned[i], response));
        println!("{i}: missed {missed:.1?} dB");
        assert!(missed[1] < -55.0, "{i}: {missed:?} dB");
    }
    assert!(after < 0.7 * before, "{before} dB before, {after} dB");
    let back = Scene::from_bytes(&room.to_bytes().unwrap()).unwrap();
    assert_eq!(back, *room);
    // Of its height alone.
    let high = Walls { size: Vec3::new(f32::INFINITY, f32::INFINITY, SIZE.z), ..walls(None).unwrap() };
    let high = bake(measured, Some(high));
    let images = high.images().unwrap();
    assert!(images.images.iter().all(|image| image.position.distance(source.with_z(image.position.z)) < 1e-3));
    let of_height = off_db(&high, &truth);
    println!("walking: {of_height:.2} dB with the height alone");
    assert!(of_height < 0.92 * before, "{before} dB before, {of_height} dB");
}

#[test]
fn a_room_measured_with_sources_around_a_listener_turns_with_the_head() {
    let hrtf = hrtf(600, RATE);
    let azimuths: Vec<f32> = (0..24).map(|i| 15.0 * i as f32).collect();
    let ring = |distance: f32| -> Vec<Response> {
        let of = |azimuth: &f32| simulated(&hrtf, LISTENER + distance * direction(*azimuth), &[at(LISTENER, 0.0)]).remove(0);
        azimuths.iter().map(of).collect()
    };
    let measured = ring(DISTANCE_M);
    let plain = bake(measured.clone(), None);
    // The scene's emitter lies ahead of the origin; a head turned to the right hears it on the left.
    let pose = |azimuth: f32, away: Vec3| at(away, -azimuth);
    let room = bake(measured.clone(), walls(None));
    for (i, response) in measured.iter().enumerate().step_by(7) {
        let missed = missed_db(&room, pose(azimuths[i], Vec3::ZERO), response);
        assert!(missed < -55.0, "{i}: {missed} dB");
    }
    // The source moves away.
    let at_2_m: Vec<(Pose, Response)> = ring(1.9)
        .into_iter()
        .enumerate()
        .step_by(5)
        .map(|(i, response)| (pose(azimuths[i], Vec3::new(DISTANCE_M - 1.9, 0.0, 0.0)), response))
        .collect();
    let source = bake(measured.clone(), walls(Some(Mover::Source)));
    let (before, after) = (off_db(&plain, &at_2_m), off_db(&source, &at_2_m));
    println!("the source at 1.9 m: {before:.2} dB without lengths, {after:.2} dB with them");
    assert!(after < 0.7 * before, "{before} dB before, {after} dB");
    // The listener walks, with the head as it was measured.
    let steps = [Vec3::new(-1.0, 0.0, 0.0), Vec3::new(0.5, 1.0, 0.0), Vec3::new(-0.7, -0.9, 0.0)];
    let places: Vec<Pose> = steps.iter().map(|step| at(LISTENER + *step, 0.0)).collect();
    let truth = simulated(&hrtf, LISTENER + DISTANCE_M * direction(0.0), &places);
    let truth: Vec<(Pose, Response)> = steps.iter().map(|step| at(*step, 0.0)).zip(truth).collect();
    let (before, after) = (off_db(&plain, &truth), off_db(&room, &truth));
    println!("walking: {before:.2} dB without lengths, {after:.2} dB with them");
    assert!(after < 0.7 * before, "{before} dB before, {after} dB");
}

mod needs_shared {
    use super::*;
    use promenade_baker::LoadOptions;
    use promenade_testing::shared;

    /// IoSR Room B, with its lengths by the published plan. Its ceiling's reflection, 1.7 ms after the direct sound, is part of
    /// that; nothing comes when the wall ahead, whose distance the plan does not state, would have it. Of the wall behind the
    /// image that goes by the floor or the ceiling too is the one that is kept: 0.37 ms late and 10.2 degrees off.
    #[test]
    #[ignore = "needs ../shared"]
    fn first_reflections_of_a_measured_room_are_where_its_walls_have_them() {
        let (listener, size) = (Vec3::new(2.325, 3.2, 1.97), Vec3::new(4.65, 8.9, 2.68));
        let folder = std::env::temp_dir().join("promenade-room-b");
        std::fs::create_dir_all(&folder).unwrap();
        let manifest = r#"{"title": "Room B", "pattern": "Room_B/16kHz/CortexBRIR_0_47s_{azimuth}deg_16k.wav",
            "azimuth_positive": "right", "distance_m": 1.5, "listener": {"position": [2.325, 3.2, 1.97], "ypr": [90, 0, 0]},
            "room": {"size": [4.65, 8.9, 2.68]}}"#;
        let file = folder.join("responses.json");
        std::fs::write(&file, manifest).unwrap();
        let options = LoadOptions { root: Some(shared("data/iosr_brir")), ..LoadOptions::default() };
        let set = Responses::load(&file, &options).unwrap();
        let scene = bake_responses(&set, |_, _| false, &BakeOptions::default()).unwrap();
        let (images, emitter) = (scene.images().unwrap(), scene.emitter().unwrap());
        let source = listener + DISTANCE_M * Vec3::Y;
        let mirrored: Vec<Vec3> = (0..6)
            .map(|wall| {
                let (axis, far) = (wall / 2, wall % 2);
                let mut image = source;
                image[axis] = 2.0 * (far as f32) * size[axis] - source[axis];
                image
            })
            .collect();
        let mut found = [0; 6];
        for step in [[0.0; 3], [0.5, 0.0, 0.0], [-1.0, 0.5, 0.0], [0.0, -1.0, 0.0], [0.6, 1.0, 0.0]].map(Vec3::from_array) {
            let pose = at(step, 0.0);
            // The head looks along the room's y.
            let head = at(listener + Vec3::new(-step.y, step.x, 0.0), 90.0);
            for (wall, image) in mirrored.iter().enumerate() {
                let wanted = head.to_head(*image);
                let near = |i: &usize| {
                    let seen = images.seen_from_head(*i, &pose, emitter);
                    let late_s = (seen.length() - wanted.length()).abs() / 343.0;
                    late_s < 0.3e-3 && seen.angle_between(wanted).to_degrees() < 10.0 && images.images[*i].gains[4] > 0.03
                };
                found[wall] += (0..images.images.len()).filter(near).count().min(1);
            }
        }
        println!("found of x = 0, x = X, y = 0, y = Y, floor, ceiling at five places: {found:?}");
        let [left, right, _, _, floor, _] = found;
        assert_eq!([left, right, floor], [5; 3], "{found:?}");
    }

    /// The head that is built in is what is made of the file of Debian's package libmysofa1.
    #[test]
    #[ignore = "needs ../shared"]
    fn the_head_is_what_its_measurements_make() {
        let made = promenade_baker::read_head(&shared("data/hrtf_kemar/MIT_KEMAR_normal_pinna.sofa")).unwrap().to_bytes();
        if made != include_bytes!("../data/kemar.head") {
            let new = std::env::temp_dir().join("kemar.head");
            std::fs::write(&new, &made).unwrap();
            panic!("another head is made: {}", new.display());
        }
    }
}
