//! How the engine sounds: blocks, latency, silence, tails, tones.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, Pose, Trim};
use promenade_metrics::tone_cleanliness;
use promenade_testing::noise;
use promenade_testing::scenes::{DIRECT, render, room, spatializer, walk};
use std::f32::consts::{PI, TAU};

const RATE: f64 = 48_000.0;

#[test]
fn any_split_into_blocks_sounds_the_same() {
    let scene = room(16_000.0, 0.5, 0.1);
    let input = noise(1, 40_000);
    let whole = render(&mut spatializer(&scene, RATE), &input, &[input.len()], &BlockParams::default(), walk(RATE));
    let random: Vec<usize> = noise(2, 97).iter().map(|v| (v.abs() * 900.0) as usize).chain([1]).collect();
    for sizes in [&[1][..], &[7], &[64], &[511], &[4096], &random] {
        let split = render(&mut spatializer(&scene, RATE), &input, sizes, &BlockParams::default(), walk(RATE));
        let worst = whole.iter().flatten().zip(split.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // -120 dB of full scale; the engine works in hops of its own, so equality is exact.
        assert!(worst <= 1e-6, "{sizes:?}: {worst}");
    }
}

#[test]
fn latency_is_what_is_reported_at_every_rate() {
    for rate in [8_000.0, 16_000.0, 22_050.0, 44_100.0, 48_000.0, 88_200.0, 96_000.0, 192_000.0] {
        let mut s = spatializer(&room(16_000.0, 0.3, 0.0), rate);
        let latency = s.latency_samples();
        assert!(latency as f64 / rate <= 1024.0 / 48_000.0, "{rate}: {latency}");
        let mut input = vec![0.0; 4 * latency];
        input[100] = 1.0;
        let peak = |x: &[f32]| (0..x.len()).max_by(|a, b| x[*a].abs().total_cmp(&x[*b].abs())).unwrap();
        let wet = render(&mut s, &input, &[512], &BlockParams::default(), |_| Pose::IDENTITY);
        assert_eq!(peak(&wet[0]), 100 + latency, "rendered at {rate}");
        assert_eq!(peak(&wet[1]), 100 + latency, "rendered at {rate}");
        s.reset();
        let dry = render(&mut s, &input, &[512], &BlockParams { mix: 0.0, ..BlockParams::default() }, |_| Pose::IDENTITY);
        assert_eq!(peak(&dry[0]), 100 + latency, "dry at {rate}");
        assert!((dry[0][100 + latency] - 1.0).abs() < 1e-7);
    }
}

#[test]
fn silence_in_is_silence_out_and_the_tail_ends_in_exact_zeros() {
    let scene = room(16_000.0, 0.3, 0.2);
    let mut s = spatializer(&scene, RATE);
    let quiet = render(&mut s, &vec![0.0; 20_000], &[512], &BlockParams::default(), walk(RATE));
    assert!(quiet.iter().flatten().all(|v| *v == 0.0));
    let mut burst = noise(3, 4_800);
    burst.resize(96_000, 0.0);
    let out = render(&mut s, &burst, &[512], &BlockParams::default(), walk(RATE));
    assert!(out[0][6_000..12_000].iter().any(|v| v.abs() > 1e-3), "the room answers");
    assert!(out.iter().all(|ear| ear[80_000..].iter().all(|v| *v == 0.0)), "and falls silent");
    assert!(out.iter().flatten().all(|v| !v.is_subnormal()));
}

#[test]
fn a_circling_tone_stays_a_tone() {
    let scene = room(16_000.0, 0.5, 0.05);
    let input: Vec<f32> = (0..4 * 48_000).map(|i| 0.5 * (TAU * (1000.0 * f64::from(i) / RATE).fract() as f32).sin()).collect();
    let circle = |i: usize| Pose::from_ypr(Vec3::ZERO, (i as f64 / RATE) as f32 * PI / 2.0, 0.0, 0.0);
    for (trim, walking) in [(DIRECT, false), (Trim::NEUTRAL, false), (Trim::NEUTRAL, true)] {
        let mut s = spatializer(&scene, RATE);
        let params = BlockParams { trim, ..BlockParams::default() };
        let out = if walking {
            render(&mut s, &input, &[512], &params, walk(RATE))
        } else {
            render(&mut s, &input, &[512], &params, circle)
        };
        let c = tone_cleanliness(&out[0], RATE, 1000.0).unwrap();
        println!("{trim:?} walking {walking}: {c:?}");
        assert!(c.outside_median_db <= -70.0 && c.outside_worst_db <= -55.0, "{trim:?} {walking}: {c:?}");
    }
}
