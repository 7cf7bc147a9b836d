//! What publications call loudness, C50, EDT and T60.

use promenade_metrics::backward_integral;

/// Added to energies, as published.
const FLOOR: f64 = 1e-9;

/// Loudness in dB, C50 in dB, EDT and T60 in seconds, as AV-DAR (Jin et al. 2025) has them on Hearing Anything Anywhere: T60 is
/// three times the time from -5 to -25 dB; EDT from where the decay crosses -10 dB; C50 from the first sample of the file.
pub(super) fn published(response: &[f32], sample_rate_hz: f64) -> [f64; 4] {
    let left = backward_integral(response.iter().map(|v| f64::from(*v).powi(2)));
    let energy = left.first().copied().unwrap_or(0.0);
    let early_end = (0.05 * sample_rate_hz) as usize;
    let early: f64 = response.iter().take(early_end).map(|v| f64::from(*v).powi(2)).sum();
    let loudness = 10.0 * (energy / sample_rate_hz + FLOOR).log10();
    let c50 = 10.0 * ((early + FLOOR) / (energy - early + FLOOR)).log10();
    if energy <= 0.0 {
        return [loudness, c50, f64::NAN, f64::NAN];
    }
    let db: Vec<f64> = left.iter().map(|e| 10.0 * (e / energy).max(1e-30).log10()).collect();
    let crossing = |level: f64| db.iter().position(|d| *d <= level).map(|i| i as f64 / sample_rate_hz);
    let edt = crossing(-10.0).map(|t| 6.0 * t);
    let t60 = crossing(-5.0).zip(crossing(-25.0)).map(|(upper, lower)| 3.0 * (lower - upper));
    [loudness, c50, edt.unwrap_or(f64::NAN), t60.unwrap_or(f64::NAN)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_has_the_figures_of_its_closed_forms() {
        let (rate, t60) = (16_000.0, 0.6);
        let decay = 3.0 * std::f64::consts::LN_10 / (t60 * rate);
        let h: Vec<f32> = (0..24_000).map(|i| (-decay * f64::from(i)).exp() as f32).collect();
        let power_left = (-0.05 * 6.0 * std::f64::consts::LN_10 / t60).exp();
        let c50 = 10.0 * ((1.0 - power_left) / power_left).log10();
        let [_, found_c50, edt, found_t60] = published(&h, rate);
        assert!((found_t60 - t60).abs() < 2e-3 && (edt - t60).abs() < 2e-3, "{edt} {found_t60}");
        assert!((found_c50 - c50).abs() < 0.02, "{found_c50} for {c50}");
        let [loudness, ..] = published(&[1.0], 1.0);
        assert!(loudness.abs() < 1e-6);
        assert!(published(&[0.0; 100], rate)[3].is_nan(), "silence has no decay");
    }
}
