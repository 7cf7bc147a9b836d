//! Energy decay of a room: Schroeder's backward integral, decay times and clarity (ISO 3382-1:2009).

use crate::{MetricError, check_finite, check_rate, energy, onset, samples_in, slope};

/// The part of a decay curve to which a line is fitted, dB relative to its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecayRange {
    /// Upper end, dB, at most 0.
    pub upper_db: f64,
    /// Lower end, dB, below the upper end.
    pub lower_db: f64,
}

impl DecayRange {
    /// Early decay time: 0 to -10 dB.
    pub const EDT: Self = Self { upper_db: 0.0, lower_db: -10.0 };
    /// T20: -5 to -25 dB.
    pub const T20: Self = Self { upper_db: -5.0, lower_db: -25.0 };
    /// T30: -5 to -35 dB. A noise floor 50 dB down makes this about a third too long; prefer T20.
    pub const T30: Self = Self { upper_db: -5.0, lower_db: -35.0 };
}

/// Energy left after each sample from the onset on, dB relative to the whole (Schroeder 1965, eq. 2).
///
/// # Errors
/// Silence or a sample that is not finite.
pub fn schroeder_db(response: &[f32]) -> Result<Vec<f64>, MetricError> {
    check_finite(response)?;
    let start = onset(response).ok_or(MetricError::Silent)?;
    let curve = backward_integral(response[start..].iter().map(|&v| f64::from(v) * f64::from(v)));
    let whole = curve[0];
    // The floor keeps the samples after the last non-zero one at -150 dB.
    Ok(curve.into_iter().map(|e| 10.0 * (e / whole + 1e-15).log10()).collect())
}

/// The sum of energies from each one on (Schroeder 1965, eq. 2); the first is that of all.
#[must_use]
pub fn backward_integral(energies: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut left: Vec<f64> = energies.into_iter().collect();
    let mut sum = 0.0;
    for e in left.iter_mut().rev() {
        sum += *e;
        *e = sum;
    }
    left
}

/// Reverberation time of a response, seconds for 60 dB of decay, from the least-squares line through the decay curve within
/// `range`.
///
/// # Errors
/// Silence, a sample that is not finite, a bad rate, or a decay with fewer than 2 samples in the range.
pub fn decay_time_s(response: &[f32], sample_rate_hz: f64, range: DecayRange) -> Result<f64, MetricError> {
    check_rate(sample_rate_hz)?;
    let curve = schroeder_db(response)?;
    let inside = curve.iter().enumerate().filter(|&(_, &d)| d <= range.upper_db && d >= range.lower_db);
    let points: Vec<(f64, f64)> = inside.map(|(i, &d)| (i as f64, d)).collect();
    let falling = slope(&points).map(|s| s * sample_rate_hz).filter(|s| *s < 0.0);
    let none = MetricError::NoDecay { upper_db: range.upper_db, lower_db: range.lower_db, found: points.len() };
    falling.map(|slope_db_per_s| -60.0 / slope_db_per_s).ok_or(none)
}

/// Clarity C50: energy of the first 50 ms after the onset over that of the rest, dB.
///
/// # Errors
/// Silence, a sample that is not finite, a bad rate, or no energy after 50 ms.
pub fn c50_db(response: &[f32], sample_rate_hz: f64) -> Result<f64, MetricError> {
    check_rate(sample_rate_hz)?;
    check_finite(response)?;
    let start = onset(response).ok_or(MetricError::Silent)?;
    let from_onset = &response[start..];
    let early = samples_in(0.05, sample_rate_hz);
    let short =
        MetricError::TooShort { measure: "C50", needed: start.saturating_add(early).saturating_add(1), found: response.len() };
    if from_onset.len() <= early {
        return Err(short);
    }
    let late = energy(&from_onset[early..]);
    if late <= 0.0 {
        return Err(short);
    }
    Ok(10.0 * (energy(&from_onset[..early]) / late).log10())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::decaying_noise;

    #[test]
    fn exponential_noise_has_its_decay_time_and_clarity() {
        for t60 in [0.3, 1.0, 3.0] {
            let h = decaying_noise(1, t60, 1.5 * t60, 48_000.0);
            for range in [DecayRange::T20, DecayRange::T30] {
                let measured = decay_time_s(&h, 48_000.0, range).unwrap();
                assert!((measured / t60 - 1.0).abs() < 0.02, "{range:?}: {measured} s for {t60} s");
            }
            let edt = decay_time_s(&h, 48_000.0, DecayRange::EDT).unwrap();
            assert!((edt / t60 - 1.0).abs() < 0.05, "EDT {edt} s for {t60} s");
            // Closed form: early energy 1 - q, late energy q, with q the power left after 50 ms.
            let q = (-0.05 * 6.0 * std::f64::consts::LN_10 / t60).exp();
            let expected = 10.0 * ((1.0 - q) / q).log10();
            assert!((c50_db(&h, 48_000.0).unwrap() - expected).abs() < 0.3, "C50 at {t60} s");
        }
    }

    #[test]
    fn a_pure_exponential_is_exact() {
        // Without noise the decay curve is a straight line, so the fit has no error but the truncation's.
        let t60 = 0.5;
        let rate = 3.0 * std::f64::consts::LN_10 / (t60 * 16_000.0);
        let h: Vec<f32> = (0..16_000).map(|i| (-rate * f64::from(i)).exp() as f32).collect();
        assert!((decay_time_s(&h, 16_000.0, DecayRange::T20).unwrap() / t60 - 1.0).abs() < 1e-5);
    }

    #[test]
    fn says_why_there_is_no_value() {
        assert_eq!(decay_time_s(&[0.0; 100], 48_000.0, DecayRange::T20), Err(MetricError::Silent));
        assert!(matches!(decay_time_s(&[1.0, 0.0], 48_000.0, DecayRange::T20), Err(MetricError::NoDecay { .. })));
        assert!(matches!(c50_db(&[1.0; 100], 48_000.0), Err(MetricError::TooShort { measure: "C50", .. })));
        assert!(matches!(c50_db(&[1.0; 100], 0.0), Err(MetricError::SampleRate { .. })));
        assert!(matches!(c50_db(&[1.0, f32::NAN], 48_000.0), Err(MetricError::NotFinite { index: 1, .. })));
    }
}
