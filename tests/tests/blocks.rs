//! The sound depends neither on the blocks, nor on the mode, nor on the run.

use promenade_tests::signal::{difference_db, noise, peak, rms};
use promenade_tests::{Host, Setup, in_both_formats, render};

in_both_formats!(
    block_sizes_do_not_change_the_sound,
    offline_sounds_as_real_time,
    activating_again_sounds_the_same,
    mono_sounds_as_two_equal_channels,
    a_turned_head_hears_the_source_at_one_side,
    blocks_of_no_samples_are_harmless,
    a_sound_beyond_full_scale_is_only_louder,
);

/// Below the last bit of 16.
const SAME_DB: f32 = -120.0;
const LEN: usize = 24_000;

fn walked<H: Host>(setup: Setup, sizes: &[usize]) -> [Vec<f32>; 2] {
    let mut host = H::open(setup);
    host.set("yaw", 0.4);
    host.set("mix", 0.9);
    let signal = noise(LEN);
    let other = signal.iter().rev().copied().collect::<Vec<_>>();
    render(&mut host, &[&signal, &other], sizes)
}

fn block_sizes_do_not_change_the_sound<H: Host>() {
    let setup = Setup { block: 4096, ..Setup::default() };
    let reference = walked::<H>(setup, &[512]);
    assert!(peak(&reference[0]) > 0.01);
    for sizes in [&[1][..], &[7], &[64], &[511], &[4096], &[1, 7, 64, 511, 4096, 3]] {
        let out = walked::<H>(setup, sizes);
        let difference = difference_db(&reference, &out);
        assert!(difference < SAME_DB, "blocks of {sizes:?} differ by {difference} dB");
    }
}

fn offline_sounds_as_real_time<H: Host>() {
    let real_time = walked::<H>(Setup::default(), &[512]);
    let offline = walked::<H>(Setup { offline: true, ..Setup::default() }, &[512]);
    assert!(difference_db(&real_time, &offline) < SAME_DB);
}

fn activating_again_sounds_the_same<H: Host>() {
    let setup = Setup::default();
    let signal = noise(LEN);
    let mut host = H::open(setup);
    let first = render(&mut host, &[&signal, &signal], &[512]);
    for _ in 0..4 {
        host.reopen(setup);
    }
    let second = render(&mut host, &[&signal, &signal], &[512]);
    assert!(difference_db(&first, &second) < SAME_DB);
}

fn mono_sounds_as_two_equal_channels<H: Host>() {
    let signal = noise(LEN);
    let mono = render(&mut H::open(Setup { inputs: 1, ..Setup::default() }), &[&signal], &[512]);
    let stereo = render(&mut H::open(Setup::default()), &[&signal, &signal], &[512]);
    assert!(peak(&mono[0]) > 0.01 && peak(&mono[1]) > 0.01);
    assert!(difference_db(&mono, &stereo) < SAME_DB);
}

fn a_turned_head_hears_the_source_at_one_side<H: Host>() {
    let signal = noise(48_000);
    let level_db = |yaw: f64| {
        let mut host = H::open(Setup::default());
        host.set("yaw", 0.5 + yaw / 360.0);
        let out = render(&mut host, &[&signal, &signal], &[512]);
        20.0 * (rms(&out[0]) / rms(&out[1])).log10()
    };
    // The factory scene's source is ahead of the origin: a head turned to the left has it at the right ear.
    let (left, right) = (level_db(60.0), level_db(-60.0));
    assert!(left < -1.5, "turned left, the left ear is {left} dB louder");
    assert!(right > 1.5, "turned right, the left ear is {right} dB louder");
}

fn blocks_of_no_samples_are_harmless<H: Host>() {
    let mut host = H::open(Setup::default());
    host.set("gain", 0.1);
    host.process(&[&[], &[]]);
    let out = host.process(&[&[0.5; 64], &[0.5; 64]]);
    assert!(out[0].iter().all(|s| s.is_finite()));
}

fn a_sound_beyond_full_scale_is_only_louder<H: Host>() {
    // A power of two changes no digit of a sample.
    let gain = 64.0;
    let quiet = noise(LEN);
    let loud = quiet.iter().map(|sample| gain * sample).collect::<Vec<_>>();
    let heard = |signal: &[f32]| render(&mut H::open(Setup::default()), &[signal, signal], &[512]);
    let (quiet, loud) = (heard(&quiet), heard(&loud));
    assert!(peak(&loud[0]) > 4.0, "the peak is {}", peak(&loud[0]));
    let as_quiet = loud.map(|ear| ear.into_iter().map(|sample| sample / gain).collect());
    let difference = difference_db(&quiet, &as_quiet);
    assert!(difference < SAME_DB, "{difference} dB");
}
