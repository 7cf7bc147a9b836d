//! Conversion between sample rates.

use promenade_audio::resample::{response, signal};
use std::f64::consts::PI;

const RATES: [(u32, u32); 8] = [
    (16_000, 48_000),
    (48_000, 16_000),
    (44_100, 48_000),
    (48_000, 44_100),
    (44_100, 96_000),
    (16_000, 44_100),
    (22_050, 48_000),
    (44_100, 22_050),
];

/// A burst far from both ends, so that only the middle of the band is in it.
fn burst(t: f64, hz: f64) -> f64 {
    (2.0 * PI * hz * (t - 0.25)).cos() * (-0.5 * ((t - 0.25) / 0.02).powi(2)).exp()
}

#[test]
fn length_and_time_stay() {
    for (from, to) in RATES {
        let sample = |rate: u32, count: u32| {
            (0..count).map(|i| burst(f64::from(i) / f64::from(rate), 1234.5) as f32).collect::<Vec<_>>()
        };
        let out = signal(&[sample(from, from / 2)], from, to).unwrap();
        assert_eq!(out[0].len(), (to / 2) as usize, "{from} to {to}");
        let expected = sample(to, to / 2);
        let error = out[0].iter().zip(&expected).fold(0.0_f32, |m, (a, b)| m.max((a - b).abs()));
        // At 1.2 kHz an error of one microsecond would be 8e-3.
        assert!(error < 2e-4, "{from} to {to}: {error}");
    }
}

#[test]
fn removes_what_the_lower_rate_cannot_hold() {
    let high: Vec<f32> = (0..24_000).map(|i| burst(f64::from(i) / 48_000.0, 12_000.0) as f32).collect();
    let out = signal(&[high], 48_000, 16_000).unwrap();
    assert!(out[0].iter().all(|v| v.abs() < 1e-4));
}

#[test]
fn a_response_keeps_its_gain() {
    let mut impulse = vec![0.0; 8000];
    impulse[4000] = 1.0;
    let out = response(&[impulse], 16_000, 48_000).unwrap();
    let gain = out[0].iter().map(|&v| f64::from(v)).sum::<f64>();
    assert!((gain - 1.0).abs() < 1e-4, "the gain at 0 Hz: {gain}");
}

#[test]
fn short_and_empty_inputs() {
    assert!(signal(&[vec![]], 16_000, 48_000).unwrap()[0].is_empty());
    assert_eq!(signal(&[vec![0.0; 3]], 16_000, 48_000).unwrap()[0].len(), 9);
    assert!(signal(&[vec![0.0; 3]], 16_000, 0).is_err());
}
