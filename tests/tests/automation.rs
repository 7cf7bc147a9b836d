//! Automation lands on its sample, later by the latency and by nothing else.

use promenade_core::{BlockParams, Pose, Renderer, Scene, Spatializer};
use promenade_tests::signal::{difference_db, first_difference, noise, peak};
use promenade_tests::{Host, Setup, in_both_formats};
use std::sync::Arc;

in_both_formats!(
    gain_steps_are_sample_accurate,
    bypass_steps_are_sample_accurate,
    several_steps_in_one_block_all_land,
    a_small_step_is_one_in_blocks_of_any_size,
    offline_a_scene_is_heard_from_the_block_that_names_it,
);

const BLOCK: usize = 512;
const LEN: usize = 20 * BLOCK;

/// Renders noise and makes parameter changes at samples of the whole signal.
fn with_changes<H: Host>(changes: &[(usize, &str, f64)]) -> ([Vec<f32>; 2], usize) {
    let mut host = H::open(Default::default());
    let signal = noise(LEN);
    let mut out = [Vec::new(), Vec::new()];
    for start in (0..LEN).step_by(BLOCK) {
        for (at, id, value) in changes.iter().filter(|(at, ..)| (start..start + BLOCK).contains(at)) {
            host.set_at(id, *value, at - start);
        }
        let block = &signal[start..start + BLOCK];
        for (all, new) in out.iter_mut().zip(host.process(&[block, block])) {
            all.extend(new);
        }
    }
    let latency = host.latency();
    (out, latency)
}

fn step_lands<H: Host>(id: &str, to: f64) {
    for offset in [0, 1, 37, 255, BLOCK - 1] {
        let at = 8 * BLOCK + offset;
        let (steady, latency) = with_changes::<H>(&[]);
        let (stepped, _) = with_changes::<H>(&[(at, id, to)]);
        assert_eq!(first_difference(&steady, &stepped), Some(at + latency), "{id} at sample {offset} of its block");
    }
}

fn gain_steps_are_sample_accurate<H: Host>() {
    step_lands::<H>("gain", 1.0);
}

fn bypass_steps_are_sample_accurate<H: Host>() {
    step_lands::<H>("bypass", 1.0);
}

fn several_steps_in_one_block_all_land<H: Host>() {
    let (first, second) = (8 * BLOCK + 100, 8 * BLOCK + 300);
    let (once, latency) = with_changes::<H>(&[(first, "gain", 1.0)]);
    let (twice, _) = with_changes::<H>(&[(first, "gain", 1.0), (second, "gain", 0.2)]);
    assert_eq!(first_difference(&once, &twice), Some(second + latency));
    let (steady, _) = with_changes::<H>(&[]);
    let until = |signal: &[Vec<f32>; 2]| [signal[0][..second].to_vec(), signal[1][..second].to_vec()];
    let early = first_difference(&until(&steady), &until(&twice));
    assert_eq!(early, (first + latency < second).then_some(first + latency));
}

/// A small step takes no longer where blocks are longer.
fn a_small_step_is_one_in_blocks_of_any_size<H: Host>() {
    const LONG: usize = 4 * 8192;
    let signal = noise(LONG);
    // In the middle of blocks, and between two of any size.
    let changes = [(5_000, "gain", 0.7986), (5_001, "late", 0.8), (20_011, "yaw", 0.51), (3 * 8192, "gain", 0.82)];
    let in_blocks = |size: usize| {
        // Live, frames of short blocks have a place of their own.
        let mut host = H::open(Setup { block: size, offline: true, ..Setup::default() });
        let mut out = [Vec::new(), Vec::new()];
        for start in (0..LONG).step_by(size) {
            for (at, id, value) in changes.iter().filter(|(at, ..)| (start..start + size).contains(at)) {
                host.set_at(id, *value, at - start);
            }
            let block = &signal[start..start + size];
            out.iter_mut().zip(host.process(&[block, block])).for_each(|(all, new)| all.extend(new));
        }
        out
    };
    let fine = in_blocks(64);
    for size in [512, 2048, 8192] {
        let coarse = in_blocks(size);
        let (difference, first) = (difference_db(&fine, &coarse), first_difference(&fine, &coarse));
        assert!(difference < -100.0, "in blocks of {size} and of 64 by {difference} dB, first at {first:?}");
    }
}

/// The engine with a factory scene, at 48 kHz.
fn room(name: &str) -> Box<Renderer> {
    let file = format!("{}/../presets/scenes/{name}.promenade", env!("CARGO_MANIFEST_DIR"));
    let scene = Arc::new(Scene::from_bytes(&std::fs::read(file).unwrap()).unwrap());
    Box::new(Renderer::new(scene, 48_000.0).unwrap())
}

fn offline_a_scene_is_heard_from_the_block_that_names_it<H: Host>() {
    let mut host = H::open(Setup::default());
    host.reopen(Setup { offline: true, ..Setup::default() });
    let first = room("loft");
    let mut engine = Spatializer::new(48_000.0);
    engine.install(first);
    let (signal, start) = (noise(LEN), Pose::IDENTITY);
    let (mut heard, mut wanted) = ([Vec::new(), Vec::new()], [vec![0.0; LEN], vec![0.0; LEN]]);
    for (number, block) in signal.chunks(BLOCK).enumerate() {
        if number == 7 {
            host.set("scene", 0.5);
            assert!(engine.swap_in(room("iosr-room-b").into()).is_ok());
        }
        heard.iter_mut().zip(host.process(&[block, block])).for_each(|(all, new)| all.extend(new));
        let [left, right] = &mut wanted;
        let span = number * BLOCK..(number + 1) * BLOCK;
        engine.process(&[block], &[], [&mut left[span.clone()], &mut right[span]], &BlockParams::default(), |_| start);
    }
    assert!(peak(&wanted[0]) > 1e-3);
    let difference = difference_db(&wanted, &heard);
    assert!(difference < -100.0, "{difference} dB from the engine that changes scenes at that block");
}
