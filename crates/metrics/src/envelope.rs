//! Amplitude envelopes by the analytic signal.

use crate::{MetricError, check_pair};
use promenade_fourier::num_complex::Complex;
use promenade_fourier::{signal, spectrum};

/// Magnitude of the analytic signal over the whole slice: the real signal and its Hilbert transform by one Fourier transform
/// (Marple 1999), so the slice is treated as periodic.
#[must_use]
pub fn envelope(samples: &[f32]) -> Vec<f64> {
    if samples.is_empty() {
        return Vec::new();
    }
    // The Hilbert transform turns positive frequencies by -90 degrees and has neither a constant nor a Nyquist part.
    let spectrum = spectrum(samples.iter().map(|&v| f64::from(v)), samples.len());
    let mut turned: Vec<_> = spectrum.iter().map(|bin| Complex::new(bin.im, -bin.re)).collect();
    turned[0].re = 0.0;
    if samples.len().is_multiple_of(2) {
        turned[samples.len() / 2].re = 0.0;
    }
    let quadrature = signal(turned, samples.len());
    samples.iter().zip(&quadrature).map(|(&re, im)| f64::from(re).hypot(*im)).collect()
}

/// Root mean square difference of two signals' envelopes.
///
/// # Errors
/// Empty signals, different lengths or samples that are not finite.
pub fn envelope_distance(first: &[f32], second: &[f32]) -> Result<f64, MetricError> {
    check_pair(first, second)?;
    if first.is_empty() {
        return Err(MetricError::TooShort { measure: "envelope distance", needed: 1, found: 0 });
    }
    let square: f64 = envelope(first).iter().zip(envelope(second)).map(|(a, b)| (a - b).powi(2)).sum();
    Ok((square / first.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_a_flat_envelope() {
        for count in [480_usize, 481] {
            let x: Vec<f32> = (0..count)
                .map(|i| (0.7 * (2.0 * std::f64::consts::PI * 10.0 * i as f64 / count as f64).cos()) as f32)
                .collect();
            assert!(envelope(&x).iter().all(|e| (e - 0.7).abs() < 1e-6), "{count} samples");
            let louder: Vec<f32> = x.iter().map(|v| 2.0 * v).collect();
            assert!((envelope_distance(&x, &louder).unwrap() - 0.7).abs() < 1e-6);
        }
        assert!(envelope(&[]).is_empty());
        assert_eq!(envelope(&[0.5]), [0.5]);
    }
}
