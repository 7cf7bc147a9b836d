//! The reported latency is the measured one.

use promenade_tests::signal::{impulse, peak, peak_index};
use promenade_tests::{ClapHost, Host, Setup, in_both_formats, render};

in_both_formats!(
    the_dry_sound_comes_out_at_the_reported_latency,
    bypass_keeps_the_latency,
    gain_is_in_decibels,
    another_sample_rate_changes_the_latency,
);

const AT: usize = 1000;

/// Where an impulse comes out after it went in.
fn measured<H: Host>(host: &mut H) -> usize {
    let signal = impulse(AT, 12_000);
    let out = render(host, &[&signal, &signal], &[512]);
    let peak = peak_index(&out[0]);
    assert!((out[0][peak] - 1.0).abs() < 1e-4, "the dry impulse comes out at unit gain, not at {}", out[0][peak]);
    peak - AT
}

fn the_dry_sound_comes_out_at_the_reported_latency<H: Host>() {
    for rate in [44_100.0, 48_000.0, 96_000.0] {
        let mut host = H::open(Setup { rate, ..Setup::default() });
        host.set("mix", 0.0);
        assert!(host.latency() > 0);
        assert_eq!(measured(&mut host), host.latency(), "at {rate} Hz");
    }
}

fn bypass_keeps_the_latency<H: Host>() {
    let mut host = H::open(Setup::default());
    host.set("bypass", 1.0);
    assert_eq!(measured(&mut host), host.latency());
}

fn gain_is_in_decibels<H: Host>() {
    let mut host = H::open(Setup::default());
    host.set("mix", 0.0);
    host.set("gain", (60.0 - 6.0) / 72.0);
    let signal = impulse(AT, 12_000);
    let out = render(&mut host, &[&signal, &signal], &[512]);
    let peak = peak(&out[0]);
    assert!((peak - 10_f32.powf(-6.0 / 20.0)).abs() < 1e-4, "-6 dB is a gain of {peak}");
}

fn another_sample_rate_changes_the_latency<H: Host>() {
    let mut host = H::open(Setup::default());
    let before = host.latency();
    host.reopen(Setup { rate: 96_000.0, ..Setup::default() });
    assert_ne!(host.latency(), before);
    host.set("mix", 0.0);
    assert_eq!(measured(&mut host), host.latency());
}

#[test]
fn a_tail_is_reported() {
    let mut host = ClapHost::open(Setup::default());
    host.process(&[&[0.0; 512], &[0.0; 512]]);
    assert!((4_800..4_800_000).contains(&host.tail()), "{} samples", host.tail());
}
