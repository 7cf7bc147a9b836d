//! A stereo sound played by two emitters some angle apart.

use promenade_core::glam::Vec3;
use promenade_core::{BlockParams, EmitterParams, Emitters, Pose, Renderer, RendererConfig, Scene, Spatializer, Trim};
use promenade_testing::noise;
use promenade_testing::scenes::{room, room_with_images};
use std::sync::Arc;

const RATE: f64 = 48_000.0;

type Ears = [Vec<f32>; 2];

fn measured() -> Arc<Scene> {
    let path = format!("{}/../presets/scenes/iosr-room-a.promenade", env!("CARGO_MANIFEST_DIR"));
    Arc::new(Scene::from_bytes(&std::fs::read(path).unwrap()).unwrap())
}

fn one(scene: &Arc<Scene>) -> Emitters {
    Renderer::new(Arc::clone(scene), RATE).unwrap().into()
}

fn pair(scene: &Arc<Scene>) -> Emitters {
    let renderer = Renderer::new(Arc::clone(scene), RendererConfig { voices: 2, ..RATE.into() }).unwrap();
    Emitters::from(renderer).with_second()
}

/// Plays both channels; `params_at` and `pose_at` are given samples, the former once a block.
fn played(
    emitters: Emitters,
    channels: [&[f32]; 2],
    params_at: impl Fn(usize) -> EmitterParams,
    pose_at: impl Fn(usize) -> Pose,
) -> Ears {
    played_with(&Trim::NEUTRAL, emitters, channels, params_at, pose_at)
}

fn played_with(
    trim: &Trim,
    emitters: Emitters,
    channels: [&[f32]; 2],
    params_at: impl Fn(usize) -> EmitterParams,
    pose_at: impl Fn(usize) -> Pose,
) -> Ears {
    let mut engine = Spatializer::new(RATE);
    engine.install(Box::new(emitters));
    let mut ears = [vec![0.0; channels[0].len()], vec![0.0; channels[0].len()]];
    let [left, right] = &mut ears;
    for start in (0..left.len()).step_by(480) {
        let span = start..left.len().min(start + 480);
        let params = BlockParams { emitters: params_at(start), trim: *trim, ..BlockParams::default() };
        let out = [&mut left[span.clone()], &mut right[span.clone()]];
        engine.process(&channels.map(|c| &c[span.clone()]), &[], out, &params, |i| pose_at(start + i));
    }
    ears
}

fn spread(degrees: f32) -> EmitterParams {
    EmitterParams { spread: degrees.to_radians(), ..EmitterParams::default() }
}

/// Level of the difference, dB of the first.
fn apart_db(first: &Ears, second: &Ears) -> f64 {
    let of = |f: &dyn Fn(f32, f32) -> f32| -> f64 {
        first.iter().flatten().zip(second.iter().flatten()).map(|(a, b)| f64::from(f(*a, *b)).powi(2)).sum()
    };
    10.0 * (of(&|a, b| a - b) / of(&|a, _| a)).log10()
}

#[test]
fn each_channel_is_heard_from_half_of_the_angle_to_its_side() {
    // Measured from one place, so that an emitter at an angle is a head that turns the other way, but for the late field, which
    // stays with the room.
    let (scene, trim) = (measured(), Trim { late: 0.0, ..Trim::NEUTRAL });
    let (sound, silence) = (noise(1, 12_000), vec![0.0; 12_000]);
    let halved: Vec<f32> = sound.iter().map(|v| 0.5 * v).collect();
    let start = scene.start_pose();
    let turned = |degrees: f32| {
        let (yaw, pitch, roll) = start.ypr();
        Pose::from_ypr(start.position, yaw + degrees.to_radians(), pitch, roll)
    };
    // From 60 ms on the second channel has the room of the first.
    for (channels, yaw, bar) in [([&sound[..], &silence[..]], -30.0, -100.0), ([&silence, &sound], 30.0, -20.0)] {
        let heard = played_with(&trim, pair(&scene), channels, |_| spread(60.0), |_| start);
        let want = played_with(&trim, one(&scene), [&halved, &halved], |_| EmitterParams::default(), |_| turned(yaw));
        let apart = apart_db(&want, &heard);
        println!("{yaw} degrees: {apart:.1} dB");
        assert!(apart < bar, "{yaw} degrees: {apart} dB");
    }
    // The left channel's emitter is on the left: earlier and louder there.
    let [left, right] = played(pair(&scene), [&sound, &silence], |_| spread(120.0), |_| start);
    let energy = |ear: &[f32]| ear.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    assert!(energy(&left) > 2.0 * energy(&right));
}

#[test]
fn emitters_stay_where_they_are_while_the_listener_walks() {
    for scene in [room(RATE, 0.5, 0.1), room_with_images(RATE, 0.5, 0.1, 8)] {
        let offset = Vec3::new(0.2, 0.1, 0.0);
        let (start, emitter) = (scene.start_pose().position, scene.emitter().unwrap());
        let (from, to) = (emitter + offset - start, 40.0_f32.to_radians());
        let turned = Vec3::new(from.x * to.cos() - from.y * to.sin(), from.x * to.sin() + from.y * to.cos(), from.z);
        let moved = EmitterParams { offset: start + turned - emitter, spread: 0.0 };
        let (sound, silence) = (noise(2, 9_600), vec![0.0; 9_600]);
        let walk = |i: usize| Pose::from_ypr(start + Vec3::new(0.3, -0.4, 0.0) * (i as f32 / 9_600.0), 0.3, 0.0, 0.0);
        let params = EmitterParams { offset, spread: 80.0_f32.to_radians() };
        let heard = played(pair(&scene), [&sound, &silence], |_| params, walk);
        let want = played(one(&scene), [&sound, &silence], |_| moved, walk);
        // Places are rounded to single precision in another order: a tenth of a micrometre is a delay.
        assert!(apart_db(&want, &heard) < -70.0, "{} dB", apart_db(&want, &heard));
    }
}

#[test]
fn without_an_angle_or_a_second_channel_nothing_changes() {
    let scene = room(RATE, 0.5, 0.1);
    let channels = [noise(3, 9_600), noise(4, 9_600)];
    let channels = channels.each_ref().map(|c| &c[..]);
    let pose = scene.start_pose();
    let plain = played(one(&scene), channels, |_| EmitterParams::default(), |_| pose);
    let same = |found: &Ears, wanted: &Ears| assert!(apart_db(wanted, found) < -120.0, "{}", apart_db(wanted, found));
    same(&played(pair(&scene), channels, |_| EmitterParams::default(), |_| pose), &plain);
    // One renderer has one emitter.
    assert!(plain == played(one(&scene), channels, |_| spread(90.0), |_| pose));
    let mut engine = Spatializer::new(RATE);
    engine.install(Box::new(pair(&scene)));
    let mut mono = [vec![0.0; 9_600], vec![0.0; 9_600]];
    let [left, right] = &mut mono;
    let params = BlockParams { emitters: spread(90.0), ..BlockParams::default() };
    engine.process(&[channels[0]], &[], [left, right], &params, |_| pose);
    same(&mono, &played(one(&scene), [channels[0]; 2], |_| EmitterParams::default(), |_| pose));
}

#[test]
fn a_sound_in_both_channels_keeps_its_level() {
    let scene = measured();
    let sound = noise(5, 14_400);
    let energy = |degrees| {
        let ears = played(pair(&scene), [&sound, &sound], |_| spread(degrees), |_| scene.start_pose());
        10.0 * ears.iter().flatten().map(|v| f64::from(*v).powi(2)).sum::<f64>().log10()
    };
    // As little apart as may be they are one emitter; far apart they add up as uncorrelated sounds do.
    assert!((energy(0.001) - energy(0.0)).abs() < 0.1, "{} {}", energy(0.001), energy(0.0));
    println!("60 degrees: {:.2} dB of one emitter", energy(60.0) - energy(0.0));
}

#[test]
fn the_angle_opens_and_closes_without_a_gap_or_a_click() {
    let scene = room(RATE, 0.5, 0.1);
    let tone: Vec<f32> = (0..72_000).map(|i| (0.02 * i as f32).sin()).collect();
    let pose = scene.start_pose();
    // A thousandth of a degree apart both emitters sound like one: whatever differs comes from opening and closing.
    let opens = |start: usize| spread(if (24_000..48_000).contains(&start) { 1e-3 } else { 0.0 });
    let plain = played(one(&scene), [&tone, &tone], |_| EmitterParams::default(), |_| pose);
    let heard = played(pair(&scene), [&tone, &tone], opens, |_| pose);
    let before = |ears: &Ears| ears.each_ref().map(|e| e[..24_000].to_vec());
    assert!(apart_db(&before(&plain), &before(&heard)) < -120.0);
    let apart = apart_db(&plain, &heard);
    println!("{apart:.1} dB");
    assert!(apart < -80.0, "{apart} dB");
}
