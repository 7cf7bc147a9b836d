//! Automation lands on its sample, later by the latency and by nothing else.

use promenade_tests::signal::{first_difference, noise};
use promenade_tests::{Host, in_both_formats};

in_both_formats!(gain_steps_are_sample_accurate, bypass_steps_are_sample_accurate, several_steps_in_one_block_all_land);

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
