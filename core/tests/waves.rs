//! Scenes whose bass waves have.

use assert_no_alloc::assert_no_alloc;
use promenade_core::glam::Vec3;
use promenade_core::{
    Axis, BassEars, BassField, BlockParams, Facing, Field, FieldGrid, Latency, Pose, Renderer, RendererConfig, Rows, Scene,
    SceneParts, Spatializer, Trim, wave_share,
};
use promenade_fourier::num_complex::Complex64;
use promenade_metrics::{DecayRange, decay_time_s};
use promenade_testing::scenes::room;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const SPEED_M_S: f64 = 343.0;
const CROSSOVER_HZ: f64 = 180.0;
/// Where the room's one reflection comes from, and how strong it is.
const IMAGE: Vec3 = Vec3::new(3.0, 4.0, -0.5);
const STRENGTH: f32 = 0.8;
/// An ear, as long waves have it.
const EAR_M: f64 = 0.131;

/// Samples a second of the waves' responses.
const RATE_HZ: f64 = 5.0 * CROSSOVER_HZ;

/// A room of direct sound, with a reflection below the crossover if there are waves.
fn scene(rate: f64, waves: bool) -> Arc<Scene> {
    let reflection = |at: Vec3| -> Vec<f32> {
        let away = f64::from(at.distance(IMAGE));
        let sinc = |n: usize| {
            let x = PI * (n as f64 - away / SPEED_M_S * RATE_HZ);
            if x.abs() < 1e-9 { 1.0 } else { x.sin() / x * (0.5 + 0.5 * (x / 60.0).clamp(-PI, PI).cos()) }
        };
        (0..200).map(|n| (f64::from(STRENGTH) / away * sinc(n)) as f32).collect()
    };
    scene_of(rate, waves.then_some(&reflection))
}

/// A room of direct sound and noise of 0.5 s that is silent, with what waves have at places below the crossover.
fn scene_of(rate: f64, pressure: Option<&dyn Fn(Vec3) -> Vec<f32>>) -> Arc<Scene> {
    let parts = room(rate, 0.5, 0.0).parts().clone();
    let mut transfer = parts.shape().silent();
    transfer.mixture.fill(1.0);
    let nodes = FieldGrid {
        position: [(); 3].map(|()| Axis::single(0.0)),
        facing: Facing::Emitter { position: Vec3::ZERO, elevation: Axis::single(0.0), azimuth: Axis::single(0.0) },
    };
    let field = Field::new(nodes, parts.shape(), Rows::Whole(transfer.to_row()));
    let places = [Axis::uniform(0.9, 0.5, 5), Axis::uniform(-0.6, 0.5, 4), Axis::single(0.1)];
    let signals = |pressure: &dyn Fn(Vec3) -> Vec<f32>, at: Vec3| -> Vec<f32> {
        let slope = |axis: Vec3| -> Vec<f32> {
            let [high, low] = [0.01, -0.01].map(|step| pressure(at + step * axis));
            high.iter().zip(low).map(|(high, low)| (high - low) / 0.02).collect()
        };
        [pressure(at), slope(Vec3::X), slope(Vec3::Y), slope(Vec3::Z)].concat()
    };
    let bass = pressure.map(|pressure| {
        let at = places[1].nodes().iter().flat_map(|y| places[0].nodes().iter().map(|x| Vec3::new(*x, *y, 0.1)));
        let samples = at.flat_map(|at| signals(pressure, at)).collect();
        let (crossover_hz, rate_hz) = (CROSSOVER_HZ, RATE_HZ);
        BassField { crossover_hz, rate_hz, places: places.clone(), direct: 1.0, samples, ears: BassEars::Head }
    });
    Arc::new(Scene::new(SceneParts { field, bass, ..parts }).unwrap())
}

/// What both ears hear of an impulse.
fn response(scene: &Arc<Scene>, rate: f64, pose: Pose, trim: Trim) -> [Vec<f32>; 2] {
    response_at(scene, (rate, Latency::Frame), pose, trim)
}

fn response_at(scene: &Arc<Scene>, (rate, latency): (f64, Latency), pose: Pose, trim: Trim) -> [Vec<f32>; 2] {
    let mut engine = Spatializer::new(rate);
    let renderer = Renderer::new(Arc::clone(scene), RendererConfig { latency, ..rate.into() }).unwrap();
    let latency = renderer.latency_samples();
    engine.install(Box::new(renderer));
    let length = latency + (3.1 * rate) as usize;
    let mut input = vec![0.0; length];
    // Trims have glided to their values by then.
    input[(0.5 * rate) as usize] = 1.0;
    let mut out = [vec![0.0; length], vec![0.0; length]];
    let [left, right] = &mut out;
    assert_no_alloc(|| {
        engine.process(&[&input], &[], [left, right], &BlockParams { trim, ..BlockParams::default() }, |_| pose)
    });
    out.map(|ear| ear[latency..].to_vec())
}

fn at(signal: &[f32], rate: f64, hz: f64) -> Complex64 {
    signal.iter().enumerate().map(|(n, x)| Complex64::cis(-TAU * hz * n as f64 / rate) * f64::from(*x)).sum()
}

#[test]
fn direct_sound_is_flat_across_the_crossover_at_every_rate() {
    for rate in [44_100.0, 48_000.0, 96_000.0] {
        let pose = Pose::from_ypr(Vec3::new(1.8, 0.0, 0.0), std::f32::consts::PI, 0.0, 0.0);
        let plain = response(&scene(rate, false), rate, pose, Trim::NEUTRAL);
        // Early and late sound off: what is left is the direct sound's.
        let trim = Trim { early: 0.0, late: 0.0, ..Trim::NEUTRAL };
        let with = response(&scene(rate, true), rate, pose, trim);
        for n in 14..=33 {
            let hz = 10.0_f64.powf(f64::from(n) / 10.0);
            let db = 20.0 * (at(&with[0], rate, hz).norm() / at(&plain[0], rate, hz).norm()).log10();
            assert!(db.abs() < 0.25, "{db} dB at {hz} Hz, {rate}");
        }
    }
}

#[test]
fn noise_and_waves_are_as_loud_together_as_noise_alone() {
    let rate = 48_000.0;
    let pose = Pose::from_ypr(Vec3::new(0.5, 0.3, 0.0), 0.4, 0.0, 0.0);
    let noise = room(rate, 0.6, 0.1);
    let trim = Trim { direct: 0.0, ..Trim::NEUTRAL };
    let plain = response(&noise, rate, pose, trim);
    let mut worst = 0.0_f64;
    for crossover_hz in [70.0, 130.0, 198.0, 250.0] {
        let places = [Axis::single(0.0), Axis::single(0.0), Axis::single(0.0)];
        let (rate_hz, samples) = (5.0 * crossover_hz, vec![0.0; 4 * 64]);
        let bass = BassField { crossover_hz, rate_hz, places, direct: 1.0, samples, ears: BassEars::Head };
        let scene = Arc::new(Scene::new(SceneParts { bass: Some(bass), ..noise.parts().clone() }).unwrap());
        // Waves are silent here: what is left is the noise beside them, and waves as loud as noise would add their share.
        let beside = response(&scene, rate, pose, trim);
        for third in 17..=27 {
            let centre = 10.0_f64.powf(f64::from(third) / 10.0);
            let [mut alone, mut left, mut waves] = [0.0; 3];
            for step in -8..8 {
                let hz = centre * 2.0_f64.powf((f64::from(step) + 0.5) / 48.0);
                for (plain, beside) in plain.iter().zip(&beside) {
                    let power = at(plain, rate, hz).norm_sqr();
                    alone += power;
                    waves += power * wave_share(hz, crossover_hz).powi(2);
                    left += at(beside, rate, hz).norm_sqr();
                }
            }
            let db = 10.0 * ((left + waves) / alone).log10();
            println!("crossover {crossover_hz} Hz, third of {centre:.0} Hz: {db:+.2} dB, noise {:.3}", left / alone);
            worst = worst.max(db.abs());
        }
    }
    // What the late part's eight hops have of more reaches beyond them where the crossover is lowest.
    assert!(worst < 1.1, "{worst} dB");
}

#[test]
fn reflections_of_the_bass_arrive_from_where_they_come() {
    let rate = 48_000.0;
    let direct = scene(rate, false);
    let waves = scene(rate, true);
    for (position, yaw) in
        [(Vec3::new(1.7, 0.3, 0.1), 0.0_f32), (Vec3::new(2.23, -0.41, 0.1), 1.3), (Vec3::new(1.4, 0.4, 0.2), -2.6)]
    {
        let pose = Pose::from_ypr(position, yaw, 0.0, 0.0);
        let heard = response(&waves, rate, pose, Trim::NEUTRAL);
        let alone = response(&waves, rate, pose, Trim { early: 0.0, late: 0.0, ..Trim::NEUTRAL });
        let plain = response(&direct, rate, pose, Trim::NEUTRAL);
        let (away, ahead) = (f64::from(position.distance(IMAGE)), f64::from(position.length()));
        let lateral = f64::from(pose.to_head(IMAGE).y) / away;
        for hz in [35.0, 60.0, 90.0, 130.0, 180.0] {
            let k = TAU * hz / SPEED_M_S;
            for (ear, side) in [(0, 1.0), (1, -1.0)] {
                let reflected = (at(&heard[ear], rate, hz) - at(&alone[ear], rate, hz)) / at(&plain[ear], rate, hz);
                // A half of a crossover over the all-pass of both halves is real.
                let allpass = at(
                    &response(
                        &waves,
                        rate,
                        Pose::from_ypr(Vec3::new(1.8, 0.0, 0.0), std::f32::consts::PI, 0.0, 0.0),
                        Trim { early: 0.0, late: 0.0, ..Trim::NEUTRAL },
                    )[0],
                    rate,
                    hz,
                ) / at(
                    &response(
                        &direct,
                        rate,
                        Pose::from_ypr(Vec3::new(1.8, 0.0, 0.0), std::f32::consts::PI, 0.0, 0.0),
                        Trim::NEUTRAL,
                    )[0],
                    rate,
                    hz,
                );
                let share = wave_share(hz, CROSSOVER_HZ);
                let ear = Complex64::new(1.0, side * k * EAR_M * lateral) / (1.0 + (k * EAR_M).powi(2) / 3.0).sqrt();
                let wave = Complex64::cis(-k * (away - ahead)) * f64::from(STRENGTH) * ahead / away;
                let wanted = wave * ear * share * allpass;
                let off = (reflected - wanted).norm() / wave.norm();
                assert!(off < 0.09, "{hz} Hz at {position}, ear {side}: {reflected} for {wanted}");
            }
        }
    }
}

/// The reflection comes while a response goes from what is heard at the high rate to what is heard at the low one. The emitter
/// is ahead or behind: of one to the side the nearer ear's bass would begin before its time.
#[test]
fn at_short_latency_the_bass_is_as_with_the_frame() {
    let rate = 48_000.0;
    let waves = scene(rate, true);
    for (position, yaw) in [(Vec3::new(1.7, 0.3, 0.1), 0.0_f32), (Vec3::new(2.23, -0.41, 0.1), 3.0)] {
        let pose = Pose::from_ypr(position, yaw, 0.0, 0.0);
        let heard = |latency| response_at(&waves, (rate, latency), pose, Trim::NEUTRAL);
        let (frame, short) = (heard(Latency::Frame), heard(Latency::Samples64));
        for hz in [35.0, 60.0, 90.0, 130.0, 180.0] {
            for (frame, short) in frame.iter().zip(&short) {
                let (frame, short) = (at(frame, rate, hz), at(short, rate, hz));
                assert!((short - frame).norm() < 0.03 * frame.norm(), "{short} for {frame} at {hz} Hz");
            }
        }
    }
}

#[test]
fn waves_ring_as_many_times_as_long_by_their_own_decay() {
    // Modes that ring for 1 s in a room whose noise takes 0.5.
    let (rate, t60_s) = (48_000.0, 1.0);
    let modes = |at: Vec3| -> Vec<f32> {
        let travels = f64::from(at.length()) / SPEED_M_S * RATE_HZ;
        let sample = |n: usize| {
            let after_s = (n as f64 - travels) / RATE_HZ;
            let rings: f64 = [52.0, 71.0, 88.0, 103.0].iter().map(|hz| (TAU * hz * after_s + f64::from(at.x) * hz).sin()).sum();
            // As slow as the rate can have it.
            let begins = (after_s / 0.02).clamp(0.0, 1.0).powi(2);
            (0.1 * begins * rings * 10.0_f64.powf(-3.0 * after_s / t60_s)) as f32
        };
        (0..(1.2 * t60_s * RATE_HZ) as usize).map(sample).collect()
    };
    let scene = scene_of(rate, Some(&modes));
    let pose = Pose::from_ypr(Vec3::new(1.7, 0.3, 0.1), 0.4, 0.0, 0.0);
    let t20 = |times: f32| {
        let ears = response(&scene, rate, pose, Trim { direct: 0.0, decay: times, ..Trim::NEUTRAL });
        ears.map(|ear| decay_time_s(&ear, rate, DecayRange::T20).unwrap()).iter().sum::<f64>() / 2.0
    };
    let plain = t20(1.0);
    for times in [0.5_f32, 0.8, 1.25, 2.0] {
        let found = t20(times) / plain;
        println!("{plain:.3} s, {times} times: {found:.3}");
        assert!((found / f64::from(times) - 1.0).abs() < 0.06, "{found} times as long instead of {times}");
    }
}

#[test]
fn a_walk_is_smooth_and_silence_ends_in_exact_zeros() {
    let rate = 48_000.0;
    let scene = scene(rate, true);
    let mut engine = Spatializer::new(rate);
    engine.install(Box::new(Renderer::new(Arc::clone(&scene), rate).unwrap()));
    let length = 96_000;
    // A tone below the crossover, under which a step would stand out.
    let input: Vec<f32> =
        (0..length).map(|n| if n < 60_000 { (TAU * 60.0 * n as f64 / rate).sin() as f32 } else { 0.0 }).collect();
    let mut out = [vec![0.0; length], vec![0.0; length]];
    let [left, right] = &mut out;
    let pose = |n: usize| Pose::from_ypr(Vec3::new(1.0 + n as f32 / 48_000.0, 0.2, 0.1), n as f32 / 30_000.0, 0.0, 0.0);
    assert_no_alloc(|| engine.process(&[&input], &[], [left, right], &BlockParams::default(), pose));
    // Second differences of a tone that moves are as small as its own.
    let own = (TAU * 60.0 / rate).powi(2) as f32;
    let most = out[0][10_000..58_000].windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f32::max);
    assert!(most < 4.0 * own, "{most} for {own}");
    assert!(out.iter().all(|ear| ear[90_000..].iter().all(|x| *x == 0.0)));
}
