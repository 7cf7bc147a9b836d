//! The engine's audio thread neither allocates nor locks nor calls the system.
//!
//! With `RTSAN_ENABLE` set (`cargo xtask test` sets it) the real-time sanitizer ends the process if it does.

use promenade_core::glam::Vec3;
use promenade_core::headphones::{HeadphoneStage, Headphones};
use promenade_core::{BlockParams, EmitterParams, Emitters, Pose, Spatializer, Voice};
use promenade_testing::noise;
use promenade_testing::scenes::{full_renderer, room_with_cloud, walk};
use std::env;
use std::hint::black_box;
use std::process::Command;

/// Set in the process that is to be ended.
const BLOCKING: &str = "PROMENADE_TEST_BLOCKING";
const RATE: f64 = 48_000.0;

/// What the audio thread does in one block.
#[rtsan_standalone::nonblocking]
fn block(
    (spatializer, headphones): (&mut Spatializer, &mut HeadphoneStage),
    next: &mut Option<Box<Emitters>>,
    done: &mut Option<Box<Emitters>>,
    input: &[f32],
    output: &mut [Vec<f32>; 2],
    (params, pose): (BlockParams, impl Fn(usize) -> Pose),
    further: &[Voice<'_>],
) {
    if done.is_none() {
        *done = spatializer.take_retired();
    }
    if let Some(renderer) = next.take() {
        *next = spatializer.swap_in(renderer).err();
    }
    let [left, right] = output;
    let (left, right) = (&mut left[..input.len()], &mut right[..input.len()]);
    spatializer.process(&[input, input], further, [&mut *left, &mut *right], &params, pose);
    headphones.process([left, right], !params.bypass);
    black_box((spatializer.latency_samples(), spatializer.tail_samples(), spatializer.samples_to_pose()));
}

#[rtsan_standalone::nonblocking]
fn allocate(len: usize) {
    black_box(vec![1.0_f32; len]);
}

#[test]
fn walking_automating_and_changing_scenes_never_blocks() {
    // One at the rate that is played, and one whose published head is converted.
    let scenes = [room_with_cloud(RATE, 0.3, 0.05), room_with_cloud(44_100.0, 1.2, 0.1)];
    let renderer = |i: usize| Box::new(Emitters::from(full_renderer(&scenes[i % 2], RATE, 5)).with_second());
    let mut spatializer = Spatializer::new(RATE);
    spatializer.install(renderer(0));
    let mut headphones = HeadphoneStage::default();
    let worn = Headphones::from_text("Filter 1: ON PK Fc 900 Hz Gain 3 dB Q 1").unwrap();
    drop(headphones.install(None, RATE));
    let mut next = None;
    let input = noise(1, 4096);
    let mut output = [vec![0.0; 4096], vec![0.0; 4096]];
    let mut at = 0;
    for (turn, len) in [512, 1, 4096, 7, 64, 0, 511].into_iter().cycle().take(700).enumerate() {
        if turn % 40 == 20 && next.is_none() {
            next = Some(renderer(turn / 40 + 1));
        }
        if turn % 50 == 10 && headphones.is_free() {
            drop(headphones.swap_in((turn % 100 == 10).then(|| Box::new(worn.filter(RATE)))));
        }
        drop(headphones.take_retired());
        let mut done = None;
        let params = BlockParams {
            mix: (turn % 5) as f32 / 4.0,
            gain: 0.5 + (turn % 3) as f32,
            bypass: turn % 90 > 80,
            emitters: EmitterParams { spread: (turn / 30 % 3) as f32, ..EmitterParams::default() },
            ..BlockParams::default()
        };
        let walk = walk(RATE);
        let pose = |i: usize| walk(at + i);
        // The second of three is silent, and then has no input at all.
        let sound = |on: bool| if on { &input[..len] } else { &[] };
        let offset = Vec3::new((turn % 7) as f32 * 0.1, 0.5, 0.0);
        let further = [true, turn % 60 < 30, turn % 100 < 50].map(|on| Voice::at(sound(on), offset));
        let (both, input) = ((&mut spatializer, &mut headphones), &input[..len]);
        block(both, &mut next, &mut done, input, &mut output, (params, pose), &further);
        at += len;
        assert!(output.iter().flatten().all(|s| s.is_finite()));
    }
}

mod needs_sanitizer {
    use super::*;

    #[test]
    #[ignore = "needs RTSAN_ENABLE"]
    fn the_sanitizer_ends_a_process_that_blocks() {
        if env::var_os(BLOCKING).is_some() {
            allocate(env::args().count());
            return;
        }
        assert!(env::var_os("RTSAN_ENABLE").is_some());
        let test = "needs_sanitizer::the_sanitizer_ends_a_process_that_blocks";
        let run = Command::new(env::current_exe().unwrap())
            .args(["--exact", "--include-ignored", test])
            .env(BLOCKING, "1")
            .output()
            .unwrap();
        assert!(!run.status.success(), "an allocation is not seen: {}", String::from_utf8_lossy(&run.stdout));
        assert!(String::from_utf8_lossy(&run.stderr).contains("RealtimeSanitizer"));
    }
}
