//! What a moving listener adds to a steady tone.

use crate::statistics::median;
use crate::{MetricError, check_finite, check_rate, samples_in};
use promenade_fourier::Fourier;
use std::f64::consts::PI;

const FRAME: usize = 4096;
const STEP: usize = 1024;
/// Skipped at the start and at the end, seconds, so that only the steady part is judged.
const LEAD_S: f64 = 0.5;
const TRAIL_S: f64 = 0.1;
/// Half width of the band counted as the tone, relative to its frequency.
const BAND: f64 = 0.2;
/// Above this the splatter is counted apart, hertz.
const HIGH_HZ: f64 = 2000.0;

/// Power beside a tone, dB relative to the power within 20 % of its frequency; smaller is cleaner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cleanliness {
    /// Outside the tone's band, median over frames.
    pub outside_median_db: f64,
    /// Outside the tone's band, worst frame.
    pub outside_worst_db: f64,
    /// Above 2 kHz, median over frames.
    pub high_median_db: f64,
    /// Above 2 kHz, worst frame.
    pub high_worst_db: f64,
}

/// Measures a rendered tone of `tone_hz` in frames of 4096 samples (Hann), from 0.5 s after the start to 0.1 s before the end.
///
/// # Errors
/// Less sound than one such frame, silence, a sample that is not finite, a bad rate, or a tone beyond half of it.
pub fn tone_cleanliness(samples: &[f32], sample_rate_hz: f64, tone_hz: f64) -> Result<Cleanliness, MetricError> {
    check_rate(sample_rate_hz)?;
    check_finite(samples)?;
    if !(tone_hz > 0.0 && tone_hz < sample_rate_hz / 2.0) {
        return Err(MetricError::Frequency { found: tone_hz, limit: sample_rate_hz / 2.0 });
    }
    let (first, trail) = (samples_in(LEAD_S, sample_rate_hz), samples_in(TRAIL_S, sample_rate_hz));
    let end = samples.len().saturating_sub(FRAME + trail);
    if first >= end {
        return Err(MetricError::TooShort {
            measure: "tone cleanliness",
            needed: first + FRAME + trail + 1,
            found: samples.len(),
        });
    }
    let fourier = Fourier::new(FRAME);
    let (mut outside_db, mut high_db) = (Vec::new(), Vec::new());
    let window = |i: usize| 0.5 - 0.5 * (2.0 * PI * i as f64 / (FRAME - 1) as f64).cos();
    for start in (first..end).step_by(STEP) {
        let spectrum = fourier.spectrum((0..FRAME).map(|i| f64::from(samples[start + i]) * window(i)));
        let (mut inside, mut outside, mut high) = (0.0, 0.0, 0.0);
        for (bin, value) in spectrum.iter().enumerate() {
            let frequency = bin as f64 * sample_rate_hz / FRAME as f64;
            let power = value.norm_sqr();
            *(if (frequency - tone_hz).abs() <= BAND * tone_hz { &mut inside } else { &mut outside }) += power;
            if frequency > HIGH_HZ {
                high += power;
            }
        }
        if inside <= 0.0 {
            return Err(MetricError::Silent);
        }
        outside_db.push(10.0 * (outside / inside).log10());
        high_db.push(10.0 * (high / inside).log10());
    }
    let worst = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Ok(Cleanliness {
        outside_worst_db: worst(&outside_db),
        high_worst_db: worst(&high_db),
        outside_median_db: median(outside_db).unwrap_or(f64::NAN),
        high_median_db: median(high_db).unwrap_or(f64::NAN),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(amplitude_at_5_khz: f64) -> Vec<f32> {
        let wave = |hz: f64, i: usize| (2.0 * PI * hz * i as f64 / 48_000.0).sin();
        (0..96_000).map(|i| (wave(1000.0, i) + amplitude_at_5_khz * wave(5000.0, i)) as f32).collect()
    }

    #[test]
    fn a_second_tone_is_found_at_its_level() {
        let pure = tone_cleanliness(&tone(0.0), 48_000.0, 1000.0).unwrap();
        assert!(pure.outside_worst_db < -75.0, "{pure:?}");
        let dirty = tone_cleanliness(&tone(0.01), 48_000.0, 1000.0).unwrap();
        assert!((dirty.outside_median_db + 40.0).abs() < 0.1 && (dirty.high_worst_db + 40.0).abs() < 0.1, "{dirty:?}");
    }

    #[test]
    fn says_why_there_is_no_value() {
        assert!(matches!(tone_cleanliness(&[0.0; 1000], 48_000.0, 1000.0), Err(MetricError::TooShort { .. })));
        assert_eq!(tone_cleanliness(&vec![0.0; 96_000], 48_000.0, 1000.0), Err(MetricError::Silent));
        assert!(matches!(tone_cleanliness(&vec![0.0; 96_000], 48_000.0, 24_000.0), Err(MetricError::Frequency { .. })));
    }
}
