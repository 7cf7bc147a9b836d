//! The plugin plays at every sample rate that hosts have.

use promenade_host::bounce;
use promenade_tests::signal::{peak, rms};
use promenade_tests::{Host, Setup, in_both_formats};
use std::f64::consts::{PI, TAU};

in_both_formats!(a_band_limited_sound_is_as_loud_at_every_rate);

const RATES: [f64; 10] = [8_000.0, 11_025.0, 16_000.0, 22_050.0, 44_100.0, 48_000.0, 88_200.0, 96_000.0, 176_400.0, 192_000.0];
const SECONDS: f64 = 0.75;

/// Tones from 150 Hz to 2.9 kHz, a fade at either end; the same sound at every rate.
fn tones(rate: f64) -> Vec<f32> {
    let count = 48;
    let tone = |k: usize| {
        let hz = 150.0 * (2_900.0_f64 / 150.0).powf(k as f64 / (count - 1) as f64);
        // Phases that spread the peaks.
        (hz, PI * (k * k) as f64 / count as f64)
    };
    let tones: Vec<_> = (0..count).map(tone).collect();
    let sample = |i: usize| {
        let t = i as f64 / rate;
        let fade = (20.0 * t.min(SECONDS - t)).clamp(0.0, 1.0);
        let sum: f64 = tones.iter().map(|(hz, phase)| (TAU * hz * t + phase).sin()).sum();
        (fade * 0.05 * sum) as f32
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "less than a second")]
    let len = (SECONDS * rate) as usize;
    (0..len).map(sample).collect()
}

fn a_band_limited_sound_is_as_loud_at_every_rate<H: Host>() {
    let levels_db = |rate: f64| {
        let mut host = H::open(Setup { rate, ..Setup::default() });
        let signal = tones(rate);
        let out = bounce(host.instance(), &[&signal, &signal], &[], 0).unwrap();
        assert!(out.iter().flatten().all(|s| s.is_finite()), "at {rate} Hz");
        assert!(peak(&out[0]) > 0.01 && peak(&out[1]) > 0.01, "silence at {rate} Hz");
        out.map(|ear| 20.0 * rms(&ear).log10())
    };
    let usual = levels_db(48_000.0);
    for rate in RATES {
        for (level, usual) in levels_db(rate).into_iter().zip(usual) {
            assert!((level - usual).abs() < 3.0, "{level} dB at {rate} Hz, {usual} dB at 48000 Hz");
        }
    }
}
