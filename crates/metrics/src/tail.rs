//! Buzz of a tail at the hop rate.

use crate::statistics::median;
use crate::{MetricError, check_finite, check_rate, envelope, samples_in};
use promenade_fourier::spectrum;
use std::f64::consts::PI;

/// Samples over which the decay is averaged out.
const SMOOTHING: usize = 4096;
/// Band whose median the line is compared with, hertz.
const COMPARED_HZ: (f64, f64) = (50.0, 400.0);

/// How far the envelope of a decaying tail is modulated at `hop_hz`, dB over the median between 50 and 400 Hz.
///
/// The envelope from `start_s` to `stop_s` is divided by its running mean over 4096 samples, and the largest of the seven
/// spectral lines around `hop_hz` (Hann window) is compared. A noise-like room tail gives about 13 dB, an audible buzz 60 dB.
///
/// # Errors
/// A range shorter than 4096 samples, a sample that is not finite, a bad rate, or a hop rate beyond half the sample rate.
pub fn tail_modulation_db(
    samples: &[f32],
    sample_rate_hz: f64,
    hop_hz: f64,
    start_s: f64,
    stop_s: f64,
) -> Result<f64, MetricError> {
    check_rate(sample_rate_hz)?;
    check_finite(samples)?;
    if !(hop_hz > 0.0 && hop_hz <= sample_rate_hz / 2.0) {
        return Err(MetricError::Frequency { found: hop_hz, limit: sample_rate_hz / 2.0 });
    }
    let stop = samples_in(stop_s, sample_rate_hz).min(samples.len());
    let tail = &samples[samples_in(start_s, sample_rate_hz).min(stop)..stop];
    if tail.len() < SMOOTHING {
        return Err(MetricError::TooShort { measure: "tail modulation", needed: SMOOTHING, found: tail.len() });
    }
    let envelope = envelope(tail);
    let flat: Vec<f64> = envelope.iter().zip(running_mean(&envelope)).map(|(e, m)| e / m).collect();
    let mean = flat.iter().sum::<f64>() / flat.len() as f64;
    if !mean.is_finite() {
        return Err(MetricError::Silent);
    }
    let last = (flat.len() - 1) as f64;
    let windowed = flat.iter().enumerate().map(|(i, v)| (v - mean) * (0.5 - 0.5 * (2.0 * PI * i as f64 / last).cos()));
    let lines: Vec<f64> = spectrum(windowed, flat.len()).iter().map(|c| c.norm()).collect();
    let spacing_hz = sample_rate_hz / flat.len() as f64;
    let hop_line = ((hop_hz / spacing_hz).round() as usize).min(lines.len() - 1);
    let around = &lines[hop_line.saturating_sub(3)..(hop_line + 4).min(lines.len())];
    let inside = |i: usize| (i as f64 * spacing_hz) > COMPARED_HZ.0 && (i as f64 * spacing_hz) < COMPARED_HZ.1;
    let compared = lines.iter().enumerate().filter(|(i, _)| inside(*i)).map(|(_, &v)| v);
    let peak = around.iter().fold(0.0_f64, |m, &v| m.max(v));
    Ok(20.0 * (peak / median(compared).unwrap_or(f64::NAN)).log10())
}

/// Mean over the 4096 samples around each one, the signal being zero beyond its ends.
fn running_mean(x: &[f64]) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(x.iter().scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        }))
        .collect();
    (0..x.len())
        .map(|i| (sums[(i + SMOOTHING / 2).min(x.len())] - sums[i.saturating_sub(SMOOTHING / 2)]) / SMOOTHING as f64)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::decaying_noise;

    #[test]
    fn a_modulated_tail_stands_out_and_a_plain_one_does_not() {
        let rate = 48_000.0;
        let plain = decaying_noise(17, 0.8, 1.0, rate);
        let hop_hz = rate / 256.0;
        let buzzing: Vec<f32> = plain
            .iter()
            .enumerate()
            .map(|(i, v)| v * (1.0 + 0.5 * (2.0 * PI * hop_hz * i as f64 / rate).cos()) as f32)
            .collect();
        let (quiet, loud) = (
            tail_modulation_db(&plain, rate, hop_hz, 0.5, 0.9).unwrap(),
            tail_modulation_db(&buzzing, rate, hop_hz, 0.5, 0.9).unwrap(),
        );
        assert!(quiet < 15.0 && loud > quiet + 15.0, "{quiet} dB plain, {loud} dB buzzing");
    }

    #[test]
    fn says_why_there_is_no_value() {
        assert!(matches!(
            tail_modulation_db(&vec![0.1; 48_000], 48_000.0, 100.0, 0.95, 2.0),
            Err(MetricError::TooShort { .. })
        ));
        assert_eq!(tail_modulation_db(&vec![0.0; 48_000], 48_000.0, 100.0, 0.0, 1.0), Err(MetricError::Silent));
        assert!(matches!(tail_modulation_db(&vec![0.0; 48_000], 48_000.0, 0.0, 0.0, 1.0), Err(MetricError::Frequency { .. })));
    }
}
