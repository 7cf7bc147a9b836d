//! What a user changes about a scene's sound, measured on what is heard of an impulse.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Scene, Trim};
use promenade_metrics::{DecayRange, decay_time_s};
use promenade_testing::noise;
use promenade_testing::scenes::{full_renderer, render, room, room_of_responses, room_with_images, spatializer};
use std::sync::Arc;

type Ears = [Vec<f32>; 2];

fn file(name: &str) -> Arc<Scene> {
    let path = format!("{}/../presets/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    Arc::new(Scene::from_bytes(&std::fs::read(path).unwrap()).unwrap())
}

/// One scene of each kind: noise, images and noise, measured responses.
fn scenes() -> [(&'static str, Arc<Scene>); 4] {
    [
        ("noise", room(48_000.0, 0.5, 0.1)),
        ("images", room_with_images(48_000.0, 0.5, 0.1, 30)),
        ("measured", file("scenes/iosr-room-a")),
        ("simulated", file("library/living-room")),
    ]
}

/// What is heard of an impulse at the start pose for some seconds from the direct sound on, at the scene's rate.
fn response(scene: &Arc<Scene>, trim: Trim, seconds: f64) -> Ears {
    response_at(scene, scene.start_pose(), BlockParams { trim, ..BlockParams::default() }, seconds)
}

fn response_at(scene: &Arc<Scene>, pose: Pose, params: BlockParams, seconds: f64) -> Ears {
    let rate = scene.grid().sample_rate_hz;
    let mut s = spatializer(scene, rate);
    let latency = s.latency_samples();
    let mut input = vec![0.0; latency + (seconds * rate) as usize];
    input[0] = 1.0;
    render(&mut s, &input, &[512], &params, |_| pose).map(|ear| ear[latency..].to_vec())
}

fn energy(ears: &Ears, scene: &Scene, seconds: std::ops::Range<f64>) -> f64 {
    let [from, to] = [seconds.start, seconds.end].map(|s| (s * scene.grid().sample_rate_hz) as usize);
    ears.iter().map(|ear| ear[from..to.min(ear.len())].iter().map(|v| f64::from(*v).powi(2)).sum::<f64>()).sum()
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// By how much the second differs from the first, dB of its energy.
fn apart_db(first: &Ears, second: &Ears) -> f64 {
    let of = |f: &dyn Fn(f32, f32) -> f32| -> f64 {
        first.iter().flatten().zip(second.iter().flatten()).map(|(a, b)| f64::from(f(*a, *b)).powi(2)).sum()
    };
    db(of(&|a, b| a - b) / of(&|a, _| a))
}

#[test]
fn the_parts_have_the_stated_levels_at_the_stated_times() {
    let six_db = 10.0_f32.powf(0.3);
    for (name, scene) in scenes() {
        let heard = |trim| response(&scene, trim, 0.6);
        let plain = heard(Trim::NEUTRAL);
        let ratio =
            |trim: Trim, from: f64, to: f64| db(energy(&heard(trim), &scene, from..to) / energy(&plain, &scene, from..to));
        let early = Trim { early: six_db, ..Trim::NEUTRAL };
        let late = Trim { late: six_db, ..Trim::NEUTRAL };
        let found =
            [ratio(early, 0.0055, 0.0775), ratio(early, 0.09, 0.4), ratio(late, 0.0055, 0.0775), ratio(late, 0.09, 0.4)];
        println!("{name}: early {:.2} {:.2} dB, late {:.2} {:.2} dB", found[0], found[1], found[2], found[3]);
        for (found, want) in found.into_iter().zip([6.02, 0.0, 0.0, 6.02]) {
            assert!((found - want).abs() < 0.25, "{name}: {found} dB, {want}");
        }
        // The parts add up to the whole, and the direct sound is what comes first.
        let silent = Trim { direct: 0.0, early: 0.0, late: 0.0, ..Trim::NEUTRAL };
        let parts = [Trim { direct: 1.0, ..silent }, Trim { early: 1.0, ..silent }, Trim { late: 1.0, ..silent }].map(heard);
        let sum: Ears = [0, 1].map(|ear| (0..plain[ear].len()).map(|i| parts.iter().map(|part| part[ear][i]).sum()).collect());
        assert!(apart_db(&plain, &sum) < -110.0, "{name}: {} dB", apart_db(&plain, &sum));
        let [direct, early, late] = &parts;
        let share = |part: &Ears, from: f64, to: f64| db(energy(part, &scene, from..to) / energy(part, &scene, 0.0..0.6));
        println!("{name}: direct after 6 ms {:.1} dB", share(direct, 0.006, 0.6));
        assert!(
            share(direct, 0.006, 0.6) < -20.0 && share(early, 0.09, 0.6) < -30.0 && share(late, 0.0, 0.075) < -15.0,
            "{name}"
        );
        assert!(heard(silent).iter().flatten().all(|v| *v == 0.0), "{name}");
    }
}

#[test]
fn the_decay_is_as_many_times_as_long() {
    for (name, scene) in [
        ("measured", file("scenes/iosr-room-a")),
        ("measured, long", file("scenes/iosr-room-b")),
        ("simulated", file("library/living-room")),
        ("simulated, long", file("library/concert-hall")),
    ] {
        let rate = scene.grid().sample_rate_hz;
        let seconds = 1.2 * f64::from(scene.tail().longest_t60_s()).min(2.0);
        let t20 = |decay: f32| {
            let params = BlockParams { trim: Trim { decay, ..Trim::NEUTRAL }, ..BlockParams::default() };
            let turned = [-0.8, -0.2, 0.3, 0.9].map(|yaw| {
                let pose = Pose::from_ypr(scene.start_pose().position, yaw, 0.0, 0.0);
                let ears = response_at(&scene, pose, params, seconds);
                ears.map(|ear| decay_time_s(&ear, rate, DecayRange::T20).unwrap()).iter().sum::<f64>()
            });
            turned.iter().sum::<f64>() / 8.0
        };
        let plain = t20(1.0);
        // A room that decays in one straight line would be nearer; the noise of the late part is of one level within 2 dB.
        for (decay, most) in [(0.5_f32, 0.1), (0.8, 0.06), (1.25, 0.06), (2.0, 0.12)] {
            let ratio = t20(decay) / plain / f64::from(decay);
            println!("{name}: {plain:.3} s, {decay} times: {ratio:.3} of it");
            assert!((ratio - 1.0).abs() < most, "{name}: {decay} times {plain:.3} s: {ratio}");
        }
    }
}

#[test]
fn the_direct_sound_falls_by_the_distance_law() {
    for (name, scene) in scenes() {
        let (start, emitter) = (scene.start_pose(), scene.emitter().unwrap());
        let place = |times: f32| Pose { position: emitter + times * (start.position - emitter), ..start };
        let direct = |times: f32, distance_law: f32| {
            let trim = Trim { early: 0.0, late: 0.0, distance_law, ..Trim::NEUTRAL };
            energy(&response_at(&scene, place(times), BlockParams { trim, ..BlockParams::default() }, 0.02), &scene, 0.0..0.02)
        };
        for (law, each_db) in [(0.0, 6.02), (0.5, 3.01), (2.0, -6.02)] {
            assert_eq!(direct(1.0, law), direct(1.0, 1.0), "{name}: nothing changes where the scene starts");
            for (times, doublings) in [(0.5, -1.0), (1.5, 0.585)] {
                let found = db(direct(times, law) / direct(times, 1.0));
                assert!((found - each_db * doublings).abs() < 0.05, "{name}: law {law} at {times}: {found} dB");
            }
        }
    }
}

#[test]
fn the_low_cut_takes_12_db_an_octave() {
    let scene = room(48_000.0, 0.3, 0.05);
    let level = |low_cut_hz: f32, hz: f64| {
        let ears = response(&scene, Trim { low_cut_hz, early: 0.0, late: 0.0, ..Trim::NEUTRAL }, 0.5);
        let sum: (f64, f64) = ears[0].iter().enumerate().fold((0.0, 0.0), |(re, im), (n, x)| {
            let (s, c) = (std::f64::consts::TAU * hz * n as f64 / 48_000.0).sin_cos();
            (re + c * f64::from(*x), im + s * f64::from(*x))
        });
        db(sum.0 * sum.0 + sum.1 * sum.1)
    };
    for corner in [80.0_f32, 300.0] {
        for (octaves, want) in [(-2.0, -24.1), (-1.0, -12.3), (0.0, -3.01), (1.0, -0.26), (3.0, 0.0)] {
            let hz = f64::from(corner) * 2.0_f64.powf(octaves);
            let found = level(corner, hz) - level(0.0, hz);
            assert!((found - want).abs() < 0.1, "{corner} Hz: {found} dB at {hz} Hz, {want}");
        }
    }
}

#[test]
fn the_width_is_the_level_of_the_rooms_difference_between_the_ears() {
    for (name, scene) in scenes() {
        let heard = |width: f32| response(&scene, Trim { width, direct: 0.0, ..Trim::NEUTRAL }, 0.4);
        let plain = heard(1.0);
        for width in [0.0_f32, 0.5, 2.0] {
            let want: Ears = [0, 1].map(|ear| {
                let pair = plain[ear].iter().zip(&plain[1 - ear]);
                pair.map(|(own, other)| 0.5 * (own + other) + 0.5 * width * (own - other)).collect()
            });
            let apart = apart_db(&want, &heard(width));
            assert!(apart < -100.0, "{name} {width}: {apart} dB");
        }
        let direct = |width: f32| response(&scene, Trim { width, early: 0.0, late: 0.0, ..Trim::NEUTRAL }, 0.05);
        assert_eq!(direct(1.0), direct(0.0), "{name}: the direct sound stays");
    }
}

#[test]
fn wet_solo_is_the_room_without_dry_and_direct_sound() {
    let (scene, _) = room_of_responses(16_000.0);
    let heard = |params: BlockParams| response_at(&scene, Pose::IDENTITY, params, 0.2);
    let room = Trim { direct: 0.0, ..Trim::NEUTRAL };
    let want = heard(BlockParams { trim: room, gain: 0.5, ..BlockParams::default() });
    let solo = BlockParams { wet_solo: true, mix: 0.5, gain: 1.0, ..BlockParams::default() };
    assert!(want.iter().flatten().any(|v| *v != 0.0));
    assert!(apart_db(&want, &heard(solo)) < -120.0);
}

/// Settings that are far apart, by turns, and none.
fn wild(turn: usize) -> Trim {
    match turn % 4 {
        0 => Trim { direct: 0.1, early: 4.0, late: 0.0, decay: 2.0, distance_law: 0.0, width: 0.0, low_cut_hz: 400.0 },
        1 => Trim { direct: 2.0, early: 0.0, late: 3.0, decay: 0.5, distance_law: 2.0, width: 2.0, low_cut_hz: 0.0 },
        2 => Trim { low_cut_hz: 60.0, ..Trim::NEUTRAL },
        _ => Trim::NEUTRAL,
    }
}

#[test]
fn what_was_changed_leaves_no_trace() {
    for (name, scene) in scenes() {
        let rate = scene.grid().sample_rate_hz;
        let pose = scene.start_pose();
        let (mut used, mut fresh) = (spatializer(&scene, rate), spatializer(&scene, rate));
        let input = noise(3, 24_000);
        for turn in 0..4 {
            let params = BlockParams { trim: wild(turn), ..BlockParams::default() };
            render(&mut used, &input[6_000 * turn..][..6_000], &[512], &params, |_| pose);
        }
        let silence = vec![0.0; (rate * (1.0 + 6.0 * f64::from(scene.tail().longest_t60_s()))) as usize];
        let ended = render(&mut used, &silence, &[512], &BlockParams::default(), |_| pose);
        assert!(ended.iter().all(|ear| ear[ear.len() - 480..].iter().all(|v| *v == 0.0)), "{name}: silent in the end");
        // The fresh one takes as many samples, so that both are in the same place of their hop.
        render(&mut fresh, &vec![0.0; 24_000 + silence.len()], &[512], &BlockParams::default(), |_| pose);
        let [used, fresh] = [&mut used, &mut fresh].map(|s| render(s, &input, &[512], &BlockParams::default(), |_| pose));
        // What is left of the past is below the smallest normal numbers.
        assert!(apart_db(&fresh, &used) < -200.0, "{name}: {} dB", apart_db(&fresh, &used));
    }
}

#[test]
fn changes_do_not_click() {
    for (name, scene) in scenes() {
        let rate = scene.grid().sample_rate_hz;
        let mut s = spatializer(&scene, rate);
        let tone: Vec<f32> = (0..(1.4 * rate) as usize)
            .map(|n| {
                ((std::f64::consts::TAU * 200.0 * n as f64 / rate).sin() * (10.0 * n as f64 / rate).min(1.0).powi(4)) as f32
            })
            .collect();
        let pose = scene.start_pose();
        let mut heard = Vec::new();
        for (turn, piece) in tone.chunks((0.1 * rate) as usize).enumerate() {
            let trim = wild(turn);
            let params = BlockParams { trim, ..BlockParams::default() };
            let [left, _] = render(&mut s, piece, &[512], &params, |_| pose);
            heard.extend(left);
        }
        // The third difference of a slow sine is tiny, that of a step is not.
        let start = (0.5 * rate) as usize;
        let rough = heard[start..].windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).fold(0.0_f32, f32::max);
        // Against the dry tone: how loud one tone is at one place is the room's affair.
        let steps = 20.0 * f64::from(rough).log10() - 60.0 * (48_000.0 / rate).log10();
        println!("{name}: {steps:.1} dB");
        assert!(steps < -40.0, "{name}: {steps} dB");
    }
}

#[test]
fn a_live_decoder_s_sound_is_trimmed_too() {
    let scene = promenade_testing::scenes::room_with_cloud(16_000.0, 0.5, 0.1);
    let scene = promenade_testing::scenes::played_by(&scene, Some(promenade_core::published::ConvMode::Off));
    let heard = |trim: Trim| {
        let mut s = promenade_core::Spatializer::new(16_000.0);
        s.install(Box::new(full_renderer(&scene, 16_000.0, 1)));
        let live = promenade_core::LiveParams { wait: true, ..Default::default() };
        let params = BlockParams { live, trim, ..BlockParams::default() };
        let mut input = vec![0.0; 8_000];
        input[0] = 1.0;
        render(&mut s, &input, &[512], &params, |_| Pose::from_ypr(Vec3::ZERO, 0.2, 0.0, 0.0))
    };
    let silent = Trim { direct: 0.0, early: 0.0, late: 0.0, ..Trim::NEUTRAL };
    let plain = heard(Trim::NEUTRAL);
    assert!(plain.iter().flatten().any(|v| *v != 0.0));
    assert!(heard(silent).iter().flatten().all(|v| *v == 0.0));
    let louder = heard(Trim { direct: 2.0, early: 2.0, late: 2.0, ..Trim::NEUTRAL });
    let want = plain.map(|ear| ear.iter().map(|v| 2.0 * v).collect::<Vec<_>>());
    assert!(apart_db(&want, &louder) < -120.0);
}
