//! A budget of processor time is shared by all instances, spent on the loud, and saved with each.
//!
//! The limit belongs to the process: one test for each format, which is a library of its own.

use promenade_tests::screen::wait_until;
use promenade_tests::signal::noise;
use promenade_tests::{Host, Setup, edit_state, in_both_formats};
use serde_json::{Value, json};
use std::f32::consts::TAU;
use std::time::Duration;

in_both_formats!(the_faint_wait_and_come_back);

const BLOCK: usize = 1024;
/// So high that one instance takes more than the least limit.
const RATE: f64 = 192_000.0;
const TONE_HZ: f32 = 200.0;
/// Samples of a period of the tone.
const PERIOD: usize = 960;

/// Sets the limit as a project does, percent.
fn limit<H: Host>(host: &mut H, percent: &Value) {
    let state = edit_state(&host.state(), "budget", percent);
    assert!(host.load(&state));
}

/// The greatest step from a sample to the next.
fn step(ear: &[f32]) -> f32 {
    ear.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
}

fn peak(ear: &[f32]) -> f32 {
    ear.iter().fold(0.0, |most, x| x.abs().max(most))
}

fn the_faint_wait_and_come_back<H: Host>() {
    let setup = Setup { block: BLOCK, rate: RATE, ..Setup::default() };
    let (mut loud, mut faint, mut other) = (H::open(setup), H::open(setup), H::open(setup));
    let dry = noise(BLOCK);
    // More than enough changes nothing.
    let free: Vec<_> = (0..20).map(|_| loud.process(&[&dry, &dry])).collect();
    limit(&mut other, &json!(1600.0));
    let limited: Vec<_> = (0..20).map(|_| other.process(&[&dry, &dry])).collect();
    assert!(free == limited, "a limit that nobody reaches is heard");
    assert_eq!(loud.state()["fields"]["budget"], other.state()["fields"]["budget"], "every instance saves the limit");

    let mut at = 0;
    let mut heard = Vec::new();
    let mut play = |loud: &mut H, faint: &mut H| {
        let tone: Vec<f32> = (at..at + BLOCK).map(|n| 1e-3 * (TAU * TONE_HZ * n as f32 / RATE as f32).sin()).collect();
        // A whole number of periods: the phase stays exact.
        at = (at + BLOCK) % PERIOD;
        loud.process(&[&dry, &dry]);
        let [ear, _] = faint.process(&[&tone, &tone]);
        let silent = ear.iter().all(|x| *x == 0.0);
        heard.extend(ear);
        // The allocator looks ten times a second of the clock, whatever the pace of blocks.
        std::thread::sleep(Duration::from_millis(4));
        silent
    };
    for _ in 0..100 {
        play(&mut loud, &mut faint);
    }
    // More than once: a click depends on where in the tone it comes back.
    for _ in 0..4 {
        limit(&mut loud, &json!(1.0));
        assert!(wait_until(Duration::from_secs(20), || play(&mut loud, &mut faint)), "the faint instance never waits");
        limit(&mut loud, &Value::Null);
        assert!(wait_until(Duration::from_secs(20), || !play(&mut loud, &mut faint)), "it never comes back");
        for _ in 0..100 {
            play(&mut loud, &mut faint);
        }
    }
    let before = &heard[50 * BLOCK..100 * BLOCK];
    let after = &heard[heard.len() - 50 * BLOCK..];
    let (level, again) = (peak(before), peak(after));
    assert!((again / level - 1.0).abs() < 0.1, "it was as loud as {level:e}, it is {again:e}");
    let (most, usual) = (step(&heard[50 * BLOCK..]), step(before));
    assert!(most < 1.5 * usual, "a click: a step of {most:e}, usually {usual:e}");
}
