//! One step beside a ring of measurements: what a scene is where nothing was measured, condition by condition.
//!
//! The small version of `tests/python/conditions.py`.

use crate::reflections::{head, hrtf, simulated_by};
use promenade_baker::{BakeOptions, Levels, Response, Responses, bake_responses};
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::spectrum;
use promenade_metrics::{DecayRange, arrival, c50_db, decay_time_s, octave_of};
use promenade_player::render_response;
use std::f64::consts::TAU;
use std::sync::Arc;

const RATE: f64 = 16_000.0;
const STEP: u16 = 20;
const LEAD: usize = 640;

/// A ring around a source 2 m ahead, T60 0.4 s, in which no direction has the noise of another; `gain` is that of a file.
fn ring(gain: impl Fn(f32) -> f32) -> Responses {
    let response = |i: u16| {
        let yaw = f32::from(STEP * i).to_radians();
        let ears = [1.0, -1.0].map(|ear| -> Vec<f32> {
            let mut random = Random::new(u64::from(2 * i) + u64::from(ear > 0.0));
            let side = -ear * yaw.sin();
            let at = 40 - (4.0 * side) as usize;
            let decayed = |n: usize| 0.1 * random.normal() * 10.0_f32.powf(-3.0 * n as f32 / (0.4 * RATE as f32));
            let mut samples: Vec<f32> = (0..8_000).map(decayed).collect();
            samples[..100].fill(0.0);
            samples[at] = 1.0 + 0.5 * side;
            samples.iter().map(|v| gain(yaw) * v).collect()
        });
        let ([left, right], listener) = (ears, Pose::from_ypr(Vec3::ZERO, yaw, 0.0, 0.0));
        Response { listener, source: 2.0 * Vec3::X, left, right, name: i.to_string() }
    };
    Responses { sample_rate_hz: RATE, responses: (0..360 / STEP).map(response).collect(), ..Responses::default() }
}

fn baked(set: &Responses) -> Arc<Scene> {
    Arc::new(bake_responses(set, |_, _| false, &BakeOptions::default()).unwrap())
}

/// Level after 20 ms, dB, and T20, seconds, of both ears.
fn room(scene: &Arc<Scene>, pose: Pose) -> (f64, f64) {
    let ears = render_response(scene, pose, LEAD, 9_000).unwrap();
    let after = LEAD + (0.02 * RATE) as usize;
    let energy: f64 = ears.iter().flat_map(|ear| &ear[after..]).map(|v| f64::from(v * v)).sum();
    let t20 = ears.iter().map(|ear| decay_time_s(&ear[LEAD..], RATE, DecayRange::T20).unwrap()).sum::<f64>() / 2.0;
    (10.0 * energy.log10(), t20)
}

/// A head turned by degrees.
fn turned(position: Vec3, yaw: f32, pitch: f32, roll: f32) -> Pose {
    Pose::from_ypr(position, yaw.to_radians(), pitch.to_radians(), roll.to_radians())
}

#[test]
fn the_room_stays_as_the_head_nods_tilts_rises_and_sinks() {
    // Louder on the left, so that directions far away are told from near ones.
    let mut set = ring(|yaw| 1.0 - 0.5 * yaw.sin());
    set.levels = Some(Levels::Measured);
    let scene = baked(&set);
    let mut conditions = Vec::new();
    for angle in [-60.0, -30.0, -15.0, 15.0, 30.0, 60.0_f32] {
        // A tilted head with the source at its side sees it above or below.
        conditions.extend([(Vec3::ZERO, 0.0, angle, 0.0), (Vec3::ZERO, 100.0, 0.0, angle), (Vec3::ZERO, 50.0, angle, angle)]);
    }
    conditions.extend([-0.7, -0.3, 0.3, 0.7].map(|height| (height * Vec3::Z, 40.0, 0.0, 0.0)));
    for (position, yaw, pitch, roll) in conditions {
        let pose = turned(position, yaw, pitch, roll);
        let seen = pose.to_head(2.0 * Vec3::X);
        let level = turned(Vec3::ZERO, -seen.y.atan2(seen.x).to_degrees(), 0.0, 0.0);
        let ((wanted_db, wanted_s), (found_db, found_s)) = (room(&scene, level), room(&scene, pose));
        let name = format!("{position}, yaw {yaw}, pitch {pitch}, roll {roll}");
        assert!((found_db - wanted_db).abs() < 0.2, "{name}: {:.2} dB", found_db - wanted_db);
        assert!((found_s / wanted_s - 1.0).abs() < 0.03, "{name}: {found_s:.3} s for {wanted_s:.3} s");
    }
}

#[test]
fn a_room_is_as_loud_at_every_turn_though_its_files_were_normalised() {
    let levels = |set: &Responses| {
        let scene = baked(set);
        let level = |turn: u16| room(&scene, turned(Vec3::ZERO, f32::from(10 * turn), 0.0, 0.0)).0;
        let all: Vec<f64> = (0..36).map(level).collect();
        all.iter().copied().fold(f64::MIN, f64::max) - all.iter().copied().fold(f64::MAX, f64::min)
    };
    let mut set = ring(|yaw| 1.0 - 0.5 * yaw.sin().abs());
    let found = levels(&set);
    assert!(found < 1.0, "{found:.2} dB");
    set.levels = Some(Levels::Measured);
    assert!(levels(&set) > 4.0, "as the files are");
}

/// Modulation from 20 to 40 Hz of a tone's envelope over its mean while the head turns by 30 degrees a second, dB.
fn flutter_db(scene: &Arc<Scene>, hz: f64) -> f64 {
    let (settled, block, blocks) = (RATE as usize / 2, RATE as usize / 400, 1024);
    let dry: Vec<f32> = (0..settled + block * blocks).map(|i| (TAU * hz * i as f64 / RATE).sin() as f32).collect();
    let mut ears = [(); 2].map(|()| vec![0.0; dry.len()]);
    let [left, right] = &mut ears;
    let mut engine = Spatializer::new(RATE);
    engine.install(Box::new(Renderer::new(Arc::clone(scene), RATE).unwrap()));
    let turned_at = |i: usize| turned(Vec3::ZERO, 30.0 * (i as f64 / RATE) as f32 - 40.0, 0.0, 0.0);
    engine.process(&[&dry], &[], [left, right], &BlockParams::default(), turned_at);
    let of_ear = |ear: &Vec<f32>| {
        let base = |(i, v): (usize, &f32)| Complex64::from_polar(f64::from(*v), -TAU * hz * i as f64 / RATE);
        let samples: Vec<Complex64> = ear.iter().enumerate().skip(settled).map(base).collect();
        let window = |i: usize| 0.5 - 0.5 * (TAU * i as f64 / blocks as f64).cos();
        let envelope = samples.chunks_exact(block).map(|b| b.iter().sum::<Complex64>().norm());
        let spectrum = spectrum(envelope.enumerate().map(|(i, v)| window(i) * v), blocks);
        let flutter: f64 = (1..blocks / 2)
            .filter(|k| (20.0..40.0).contains(&(400.0 * *k as f64 / blocks as f64)))
            .map(|k| spectrum[k].norm_sqr())
            .sum();
        // A sine has a quarter of its amplitude's square on each side, spread by the window to 3/2 of that.
        10.0 * (4.0 * flutter / 1.5 / spectrum[0].norm_sqr()).log10()
    };
    ears.iter().map(of_ear).fold(f64::MIN, f64::max)
}

#[test]
fn high_tones_do_not_flutter_while_the_head_turns() {
    let scene = baked(&ring(|_| 1.0));
    for hz in [1_000.0, 3_000.0, 5_000.0, 6_500.0] {
        let found = flutter_db(&scene, hz);
        assert!(found < -35.0, "{hz} Hz: {found:.1} dB");
    }
}

/// Sample rate of the box, hertz, and its rays.
const BOX_RATE: u32 = 24_000;
const BOX_RAYS: usize = 2000;

/// Measures of a pair of responses, in the order of [`MEASURES`]; a scene's have its own gain.
fn measures(ears: [&[f32]; 2], gain: f64) -> Vec<f64> {
    let rate = f64::from(BOX_RATE);
    let arrival = arrival(ears, rate).unwrap();
    let mut out = vec![1e6 * arrival.delay_s, arrival.level_db + gain];
    for hz in [250.0, 500.0, 1000.0, 2000.0, 4000.0] {
        let bands = ears.map(|ear| octave_of(ear, rate, hz));
        let energies = bands.each_ref().map(|band| band.iter().map(|v| f64::from(v * v)).sum::<f64>());
        let db = |energy: f64| 10.0 * energy.log10();
        let mean = |of: fn(&[f32]) -> f64| 0.5 * bands.iter().map(|band| of(band)).sum::<f64>();
        let t20 = mean(|band| decay_time_s(band, f64::from(BOX_RATE), DecayRange::T20).unwrap());
        let c50 = mean(|band| c50_db(band, f64::from(BOX_RATE)).unwrap());
        out.extend([db(energies[0] + energies[1]) + gain, db(energies[0] / energies[1]), 100.0 * t20.ln(), c50]);
    }
    out
}

/// Just noticeable differences: of the direct sound's ITD and level, then in each octave of level, ILD, T20 and C50
/// (ISO 3382-1, and `tests/python/conditions.py`).
const MEASURES: [(&str, f64); 6] =
    [("ITD, us", 20.0), ("direct, dB", 1.0), ("level, dB", 1.0), ("ILD, dB", 1.0), ("T20, %", 5.0), ("C50, dB", 1.0)];

/// Means over poses of the magnitudes of errors, and over octaves.
fn errors(found: &[Vec<f64>], wanted: &[Vec<f64>]) -> [f64; 6] {
    let (mut sums, mut counts) = ([0.0; 6], [0.0; 6]);
    for (found, wanted) in found.iter().zip(wanted) {
        for (i, (a, b)) in found.iter().zip(wanted).enumerate() {
            let measure = if i < 2 { i } else { 2 + (i - 2) % 4 };
            sums[measure] += (a - b).abs();
            counts[measure] += 1.0;
        }
    }
    std::array::from_fn(|i| sums[i] / counts[i])
}

/// Two rings of ten degrees, a metre apart, in a box, and what the same box is at poses that the scene has never seen.
#[test]
fn one_step_beside_two_rings_nothing_is_noticed_that_the_nearest_measurement_does_not_have() {
    let (hrtf, source) = (hrtf(6000, BOX_RATE), Vec3::new(3.9, 2.9, 1.5));
    let places = [Vec3::new(2.4, 2.2, 1.5), Vec3::new(2.4, 3.2, 1.5)];
    let towards = |place: Vec3| (source - place).y.atan2((source - place).x).to_degrees();
    // Directions from which the source is heard, as a head has them that turns on its spot.
    let facing = |place: Vec3, azimuth: f32| turned(place, towards(place) - azimuth, 0.0, 0.0);
    let ring: Vec<Pose> = places.iter().flat_map(|p| (0..36).map(|i| facing(*p, 10.0 * i as f32))).collect();
    let set = simulated_by(BOX_RAYS, &hrtf, source, &ring);
    let measured = Responses { sample_rate_hz: BOX_RATE.into(), responses: set.clone(), ..Responses::default() };
    let options = BakeOptions { head: Some(head()), ..BakeOptions::default() };
    let scene = Arc::new(bake_responses(&measured, |_, _| false, &options).unwrap());
    let about = [35.0, 75.0, 115.0, 155.0, 215.0, 305.0_f32];
    let at = |of: &dyn Fn(f32) -> Pose| about.iter().map(|azimuth| of(*azimuth)).collect::<Vec<Pose>>();
    let tilted = |pitch: f32, roll: f32| {
        at(&|azimuth| {
            let mut pose = facing(places[0], azimuth - 5.0);
            pose.orientation *= turned(Vec3::ZERO, 0.0, pitch, roll).orientation;
            pose
        })
    };
    let moved = |by: Vec3| at(&|azimuth| Pose { position: places[0] + by, ..facing(places[0], azimuth - 5.0) });
    let conditions = [
        ("measured", at(&|azimuth| facing(places[0], azimuth - 5.0))),
        ("between azimuths", at(&|azimuth| facing(places[0], azimuth))),
        ("pitch 30", tilted(30.0, 0.0)),
        ("roll 30", tilted(0.0, 30.0)),
        ("0.3 m up", moved(0.3 * Vec3::Z)),
        ("between places", moved(0.5 * Vec3::Y)),
        ("0.3 m nearer", moved(0.3 * (source - places[0]).normalize())),
    ];
    // The scene's gain is that of the measured poses.
    let of = |ears: [&[f32]; 2]| measures(ears, 0.0);
    let heard = |poses: &[Pose], gain: f64| -> Vec<Vec<f64>> {
        let of = |pose: &Pose| {
            let [left, right] = render_response(&scene, *pose, LEAD, 9_600 + LEAD).unwrap();
            measures([&left, &right], gain)
        };
        poses.iter().map(of).collect()
    };
    let mut gain = 0.0;
    for (name, poses) in conditions {
        let made = simulated_by(BOX_RAYS, &hrtf, source, &poses);
        let wanted: Vec<_> = made.iter().map(|r| of([&r.left, &r.right])).collect();
        let nearest: Vec<_> = poses
            .iter()
            .map(|pose| {
                let seen = |pose: &Pose| pose.to_head(source).normalize();
                let off = |r: &&Response| {
                    let apart = r.listener.position.distance(pose.position);
                    (1e3 * apart, -seen(&r.listener).dot(seen(pose)))
                };
                let best = set.iter().min_by(|a, b| off(a).0.total_cmp(&off(b).0).then(off(a).1.total_cmp(&off(b).1)));
                best.map(|r| of([&r.left, &r.right])).unwrap()
            })
            .collect();
        let mut found = heard(&poses, gain);
        if name == "measured" {
            gain = found.iter().zip(&wanted).map(|(a, b)| b[1] - a[1]).sum::<f64>() / poses.len() as f64;
            found = heard(&poses, gain);
        }
        let (ours, nearest) = (errors(&found, &wanted), errors(&nearest, &wanted));
        for ((measure, jnd), (ours, nearest)) in MEASURES.iter().zip(ours.iter().zip(nearest)) {
            println!("{name:<18} {measure:<11} {ours:6.2} / {nearest:6.2}");
            // A tenth more than the nearest's is no worse.
            assert!(*ours < jnd.max(1.1 * nearest), "{name}, {measure}: {ours:.2}, nearest measurement {nearest:.2}");
        }
    }
}
