//! Signals with known measures.

/// Uniform noise in [-1, 1), the same on every machine.
pub(crate) fn noise(seed: u64, count: usize) -> Vec<f64> {
    promenade_testing::Noise::new(seed).take(count).map(f64::from).collect()
}

/// Exponentially decaying noise that falls by 60 dB in `t60_s`.
pub(crate) fn decaying_noise(seed: u64, t60_s: f64, seconds: f64, sample_rate_hz: f64) -> Vec<f32> {
    let count = (seconds * sample_rate_hz) as usize;
    let rate = 3.0 * std::f64::consts::LN_10 / (t60_s * sample_rate_hz);
    noise(seed, count).iter().enumerate().map(|(i, v)| (v * (-rate * i as f64).exp()) as f32).collect()
}

/// A band-limited pulse around `centre` (samples, fractional): a sinc under a Gaussian, 4 kHz wide at 48 kHz.
pub(crate) fn pulse(centre: f64, count: usize) -> Vec<f32> {
    (0..count)
        .map(|i| {
            let x = i as f64 - centre;
            let width = 12.0_f64;
            let sinc =
                if x.abs() < 1e-12 { 1.0 } else { (std::f64::consts::PI * x / 6.0).sin() / (std::f64::consts::PI * x / 6.0) };
            (sinc * (-0.5 * (x / width).powi(2)).exp()) as f32
        })
        .collect()
}
