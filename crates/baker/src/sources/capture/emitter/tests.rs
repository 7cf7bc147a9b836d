use super::*;
use crate::signal::convolve::shape;
use crate::sources::capture::{Clip, Track, Voice};
use promenade_core::random::Random;
use promenade_core::{CameraPath, Keyframe};
use promenade_fourier::num_complex::Complex32;

const RATE: f64 = 16_000.0;
const EMITTER: Vec3 = Vec3::new(2.5, 1.5, 1.8);

/// Bursts of noise from [`EMITTER`], with an echo, heard from poses over seconds of track by ears as far apart in time as a
/// sphere's; each clip is late by up to `unsteady_s`.
fn capture(poses: &[Pose], unsteady_s: f32) -> Capture {
    let mut random = Random::new(5);
    let sphere = CloudEmitter::with_sphere(EMITTER, HEAD_RADIUS_M);
    let track = |pose: &Pose| {
        let dry: Vec<f32> = (0..9600).map(|i| if i % 3000 < 1200 { 0.3 * random.normal() } else { 0.0 }).collect();
        let late_s = unsteady_s * random.uniform();
        let distance = pose.position.distance(EMITTER);
        let half = 0.5 * sphere.delay_s(pose);
        let echo_s = 0.004 + 0.01 * random.uniform();
        let wet = shape(&dry, RATE, |hz| {
            let wave = |gain: f32, s: f32| Complex32::from_polar(gain, -std::f32::consts::TAU * hz as f32 * s);
            let direct_s = distance / SPEED_OF_SOUND_M_S + late_s;
            let echo = wave(0.4 / distance, direct_s + echo_s);
            [half, -half].map(|ear_s| wave(1.0 / distance, direct_s + ear_s) + echo)
        });
        let binaural = wet.map(|ear| ear.iter().map(|v| v + 1e-3 * random.normal()).collect());
        let path = CameraPath::new(vec![Keyframe { t_s: 0.0, pose: *pose }]).unwrap();
        Track { name: String::new(), voices: vec![Voice { emitter: None, dry }], binaural, path }
    };
    let clip = |(track, pose): (usize, &Pose)| Clip {
        name: String::new(),
        track,
        start: 1600,
        len: 8000,
        pose: *pose,
        split: if track % 5 == 4 { Split::Test } else { Split::Train },
    };
    Capture {
        sample_rate_hz: RATE,
        tracks: poses.iter().map(track).collect(),
        clips: poses.iter().enumerate().map(clip).collect(),
        ..Capture::default()
    }
}

/// Once round and a little up and down, looking about.
fn walk(count: usize) -> Vec<Pose> {
    let pose = |i: usize| {
        let turn = std::f32::consts::TAU * i as f32 / count as f32;
        let place = Vec3::new(1.5 * turn.cos(), turn.sin(), 1.5 + 0.3 * (2.0 * turn).sin());
        Pose::from_ypr(place, 3.0 * turn, 0.3 * (5.0 * turn).sin(), 0.3 * (4.0 * turn).cos())
    };
    (0..count).map(pose).collect()
}

#[test]
fn a_walk_tells_where_the_sound_came_from() {
    let found = locate_emitter(&capture(&walk(40), 0.0)).unwrap();
    assert!(found.position.distance(EMITTER) < 0.1, "{found:?}");
    assert!(found.spread_m < 0.5 && found.itd_residual_us < 30.0 && found.level_residual_db < 1.0, "{found:?}");
    assert!(found.arrival_residual_us.is_some_and(|us| us < 60.0), "{found:?}");
    assert_eq!(found.clips, 32, "training clips only");
}

#[test]
fn without_a_common_clock_delays_and_levels_tell_it() {
    let found = locate_emitter(&capture(&walk(40), 0.02)).unwrap();
    assert!(found.position.distance(EMITTER) < 0.3, "{found:?}");
    assert_eq!(found.arrival_residual_us, None);
}

#[test]
fn a_straight_walk_leaves_above_and_below_open() {
    let poses: Vec<Pose> = (0..40).map(|i| Pose { position: Vec3::new(0.08 * i as f32, 0.0, 0.6), ..Pose::IDENTITY }).collect();
    let found = locate_emitter(&capture(&poses, 0.0)).unwrap();
    let mirrored = Vec3::new(EMITTER.x, EMITTER.y, 1.2 - EMITTER.z);
    assert!(found.position.distance(EMITTER).min(found.position.distance(mirrored)) < 0.3, "{found:?}");
    assert!(found.spread_m > 2.0, "{found:?}");
}

#[test]
fn who_stands_still_is_refused() {
    let turning: Vec<Pose> = walk(40).iter().map(|p| Pose { position: Vec3::ZERO, ..*p }).collect();
    let error = locate_emitter(&capture(&turning, 0.0)).unwrap_err().to_string();
    assert!(error.contains("walks") && error.contains("found 0.00 m"), "{error}");
    let error = locate_emitter(&capture(&walk(10), 0.0)).unwrap_err().to_string();
    assert!(error.contains("at least 12 training clips"), "{error}");
    let mut silent = capture(&walk(40), 0.0);
    silent.tracks.iter_mut().for_each(|t| t.voices[0].dry.fill(0.0));
    assert!(locate_emitter(&silent).is_err());
}
