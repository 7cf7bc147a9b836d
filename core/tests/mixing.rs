//! Gain, mix, bypass and scene changes belong to the sample they come with.

use promenade_core::{BlockParams, Pose, Renderer, Spatializer};
use promenade_testing::noise;
use promenade_testing::scenes::{render, room, spatializer};
use std::sync::Arc;

const RATE: f64 = 48_000.0;
const STILL: fn(usize) -> Pose = |_| Pose::IDENTITY;

/// Renders a constant with settings that change at sample `step`.
fn stepped(s: &mut Spatializer, before: BlockParams, after: BlockParams, step: usize, len: usize) -> Vec<f32> {
    let input = vec![1.0; len];
    let mut left = render(s, &input[..step], &[100], &before, STILL)[0].clone();
    left.extend(&render(s, &input[step..], &[100], &after, STILL)[0]);
    left
}

#[test]
fn steps_land_at_the_latency_plus_their_offset() {
    let dry = BlockParams { mix: 0.0, ..BlockParams::default() };
    let quiet = BlockParams { gain: 0.5, ..dry };
    let bypassed = BlockParams { bypass: true, ..quiet };
    for (before, after) in [(dry, quiet), (quiet, bypassed), (bypassed, quiet)] {
        let mut s = spatializer(&room(16_000.0, 0.3, 0.1), RATE);
        let (latency, step) = (s.latency_samples(), 5_123);
        let out = stepped(&mut s, before, after, step, 12_000);
        let first = (latency + 1..out.len()).find(|&i| out[i] != out[i - 1]).unwrap();
        assert_eq!(first, latency + step, "{before:?} to {after:?}");
        // The ramp is over 1 ms later.
        assert!(out[first + 48..].iter().all(|v| *v == out[first + 48]));
    }
}

#[test]
fn dry_and_rendered_sound_are_aligned() {
    // A scene whose masks are 1 and that has no room is a wire: half dry, half rendered is the input again.
    let scene = room(16_000.0, 0.3, 0.0);
    let input = noise(3, 20_000);
    let wire = |mix: f32| {
        let mut s = spatializer(&scene, RATE);
        render(&mut s, &input, &[512], &BlockParams { mix, ..BlockParams::default() }, STILL)
    };
    let (dry, wet, half) = (wire(0.0), wire(1.0), wire(0.5));
    for i in 0..input.len() {
        assert!((half[0][i] - 0.5 * (dry[0][i] + wet[0][i])).abs() < 1e-6);
    }
    let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    let product: f64 = dry[0].iter().zip(&wet[0]).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
    assert!(product / (energy(&dry[0]) * energy(&wet[0])).sqrt() > 0.999, "the same sound at the same time");
}

#[test]
fn stereo_input_stays_stereo_when_dry_and_is_averaged_when_rendered() {
    let scene = room(16_000.0, 0.3, 0.1);
    let (a, b) = (noise(4, 8_000), noise(5, 8_000));
    let mean: Vec<f32> = a.iter().zip(&b).map(|(a, b)| 0.5 * (a + b)).collect();
    let run = |channels: &[&[f32]], mix: f32| {
        let mut s = spatializer(&scene, RATE);
        let (mut left, mut right) = (vec![0.0; 8_000], vec![0.0; 8_000]);
        s.process(channels, &[], [&mut left, &mut right], &BlockParams { mix, ..BlockParams::default() }, STILL);
        (left, right, s.latency_samples())
    };
    let (left, right, latency) = run(&[&a, &b], 0.0);
    assert!(left[latency..].iter().zip(&a).all(|(x, y)| x == y) && right[latency..].iter().zip(&b).all(|(x, y)| x == y));
    assert_eq!(run(&[&a, &b], 1.0), run(&[&mean], 1.0));
}

#[test]
fn a_scene_change_while_playing_does_not_click() {
    let (first, second) = (room(16_000.0, 0.3, 0.1), room(48_000.0, 0.6, 0.05));
    let tone: Vec<f32> = (0..48_000).map(|i| 0.5 * (std::f32::consts::TAU * 200.0 * i as f32 / 48_000.0).sin()).collect();
    let mut s = spatializer(&first, RATE);
    let mut out = render(&mut s, &tone[..24_000], &[512], &BlockParams::default(), STILL)[0].clone();
    let steady = steepest(&out[12_000..]);
    assert!(s.swap_in(Box::new(Renderer::new(Arc::clone(&second), RATE).unwrap().into())).is_ok());
    let refused = s.swap_in(Box::new(Renderer::new(first, RATE).unwrap().into()));
    assert!(refused.is_err(), "one fade at a time");
    out.extend(&render(&mut s, &tone[24_000..], &[512], &BlockParams::default(), STILL)[0]);
    assert!(steepest(&out[20_000..]) < 1.5 * steady, "{} against {steady}", steepest(&out[20_000..]));
    assert!(s.take_retired().is_some());
    assert_eq!(s.latency_samples(), Renderer::new(second, RATE).unwrap().latency_samples());
}

#[test]
fn without_a_scene_the_dry_sound_passes_and_a_scene_fades_in() {
    let mut s = Spatializer::new(RATE);
    let input = noise(6, 9_000);
    let params = BlockParams { gain: 0.5, ..BlockParams::default() };
    let out = render(&mut s, &input, &[512], &params, STILL);
    assert!(out[0].iter().zip(&input).all(|(o, i)| (o - 0.5 * i).abs() < 1e-6));
    let renderer = Renderer::new(room(16_000.0, 0.3, 0.0), RATE).unwrap();
    assert!(s.swap_in(Box::new(renderer.into())).is_ok());
    let out = render(&mut s, &vec![0.25; 9_000], &[512], &params, STILL);
    assert!(steepest(&out[0][1_000..]) < 0.01);
}

#[test]
fn reset_jumps_to_the_next_pose() {
    let scene = room(16_000.0, 0.3, 0.0);
    let left = |_: usize| Pose::from_ypr(promenade_core::glam::Vec3::ZERO, 1.5, 0.0, 0.0);
    let input = noise(7, 4_000);
    let mut fresh = spatializer(&scene, RATE);
    let want = render(&mut fresh, &input, &[512], &BlockParams::default(), left);
    let mut used = spatializer(&scene, RATE);
    render(&mut used, &noise(8, 10_000), &[512], &BlockParams { gain: 0.1, ..BlockParams::default() }, STILL);
    used.reset();
    assert_eq!(render(&mut used, &input, &[512], &BlockParams::default(), left), want);
}

fn steepest(x: &[f32]) -> f32 {
    x.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max)
}
