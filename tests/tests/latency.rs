//! The reported latency is the measured one.

use promenade_host::bounce;
use promenade_tests::signal::{impulse, noise, peak, peak_index};
use promenade_tests::{Host, Setup, in_both_formats, render};

in_both_formats!(
    the_dry_sound_comes_out_at_the_reported_latency,
    bypass_keeps_the_latency,
    gain_is_in_decibels,
    another_sample_rate_changes_the_latency,
    a_new_instance_asks_for_no_other_activation,
    the_tail_is_known_whenever_a_host_asks,
    a_bounce_of_a_fresh_project_ends_with_its_tail,
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

fn a_new_instance_asks_for_no_other_activation<H: Host>() {
    let mut host = H::open(Setup::default());
    let latency = host.latency();
    host.process(&[&[0.0; 512], &[0.0; 512]]);
    assert_eq!(host.latency(), latency);
    assert_eq!(host.instance().restarts(), 0);
    // Hosts read another latency when they have activated the plugin again by themselves.
    host.reopen(Setup { rate: 96_000.0, ..Setup::default() });
    assert_ne!(host.latency(), latency);
    assert_eq!(host.instance().restarts(), 0);
}

fn the_tail_is_known_whenever_a_host_asks<H: Host>() {
    let mut host = H::open(Setup::default());
    let tail = host.tail();
    assert!((4_800..4_800_000).contains(&tail), "{tail} samples after the activation");
    let sound = noise(512);
    host.process(&[&sound, &sound]);
    assert_eq!(host.tail(), tail, "while it sounds");
    let silence = vec![0.0; 2 * tail];
    render(&mut host, &[&silence, &silence], &[512]);
    assert_eq!(host.tail(), tail, "in silence");
    host.reopen(Setup { offline: true, ..Setup::default() });
    assert_eq!(host.tail(), tail, "before a bounce");
    // The user's decay counts at once.
    host.set("decay", 1.0);
    host.process(&[&[0.0; 512], &[0.0; 512]]);
    // This host of VST3 asks when it sets the plugin up.
    host.reopen(Setup { offline: true, ..Setup::default() });
    assert!(host.tail() > tail + tail / 4, "{} samples, {tail} with the room's own decay", host.tail());
}

fn a_bounce_of_a_fresh_project_ends_with_its_tail<H: Host>() {
    let mut host = H::open(Setup { offline: true, ..Setup::default() });
    let tail = host.tail();
    let sound = noise(4800);
    let out = bounce(host.instance(), &[&sound, &sound], &[], 2 * tail).unwrap();
    let energy = |part: &[f32]| part.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    let [early, late] = [&out[0][4800..4800 + tail], &out[0][4800 + tail..]].map(energy);
    assert!(early > 0.0, "nothing sounds on");
    assert!(late < 1e-6 * early, "{:.1} dB come after the tail", 10.0 * (late / early).log10());
}
