//! Parts of a signal's spectrum: one octave of it, and its level around frequencies.

use promenade_fourier::{signal, spectrum};
use std::f64::consts::FRAC_PI_2;

/// Octaves over which the edge of a band falls.
const EDGE: f64 = 1.0 / 3.0;

/// The octave of a signal around a frequency, as long as the signal and not delayed. The edges fall over a third of an octave,
/// so that the powers of neighbouring octaves add up to that of the whole.
#[must_use]
pub fn octave_of(x: &[f32], sample_rate_hz: f64, centre_hz: f64) -> Vec<f32> {
    // As much silence after it: what rings before the start comes to lie there.
    let length = (2 * x.len()).next_power_of_two().max(2);
    let mut bins = spectrum(x.iter().map(|&v| f64::from(v)), length);
    for (k, bin) in bins.iter_mut().enumerate() {
        let from_centre = (k as f64 * sample_rate_hz / length as f64 / centre_hz).log2().abs();
        // From 0 half an edge inside of half an octave to 1 half an edge outside of it.
        let out = ((from_centre - 0.5) / EDGE + 0.5).clamp(0.0, 1.0);
        *bin *= (FRAC_PI_2 * out).cos();
    }
    signal(bins, length).into_iter().take(x.len()).map(|v| v as f32).collect()
}

/// Levels of a response around frequencies, dB above the spectrum of a unit impulse: mean power over `octaves` around each. The
/// nearest bin counts where there is none in between; a frequency beyond half of the sample rate has no level, minus infinity.
#[must_use]
pub fn smoothed_levels_db(x: &[f32], sample_rate_hz: f64, centres_hz: &[f64], octaves: f64) -> Vec<f64> {
    let length = x.len().next_power_of_two().max(2);
    let bins = spectrum(x.iter().map(|&v| f64::from(v)), length);
    let mut below = Vec::with_capacity(bins.len() + 1);
    let mut sum = 0.0;
    below.push(sum);
    for bin in &bins {
        sum += bin.norm_sqr();
        below.push(sum);
    }
    let half = 2.0_f64.powf(octaves / 2.0);
    let place = |hz: f64| hz * length as f64 / sample_rate_hz;
    let level = |&centre: &f64| {
        if centre > sample_rate_hz / 2.0 {
            return f64::NEG_INFINITY;
        }
        let (low, high) = (place(centre / half).ceil() as usize, place(centre * half).floor() as usize);
        let nearest = (place(centre).round() as usize).min(bins.len() - 1);
        let (low, high) = if low <= high { (low, high.min(bins.len() - 1)) } else { (nearest, nearest) };
        10.0 * ((below[high + 1] - below[low]) / (high + 1 - low) as f64).log10()
    };
    centres_hz.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::{decaying_noise, noise};
    use crate::{DecayRange, decay_time_s};

    #[test]
    fn octaves_add_up_to_the_whole_and_keep_their_decay() {
        let x: Vec<f32> = noise(5, 32_768).iter().map(|v| *v as f32).collect();
        let power = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let octaves = (0..10).map(|o| power(&octave_of(&x, 48_000.0, 31.25 * 2.0_f64.powi(o)))).collect::<Vec<f64>>();
        // 22 Hz to 22.6 kHz of 24 kHz.
        let share = octaves.iter().sum::<f64>() / power(&x);
        assert!((share - 0.945).abs() < 0.01, "{share}");
        assert!((octaves[6] / octaves[5] - 2.0).abs() < 0.2, "white noise: each octave has twice the one below");
        let h = decaying_noise(1, 0.8, 1.2, 48_000.0);
        let measured = decay_time_s(&octave_of(&h, 48_000.0, 1000.0), 48_000.0, DecayRange::T20).unwrap();
        assert!((measured / 0.8 - 1.0).abs() < 0.05, "{measured}");
    }

    #[test]
    fn an_impulse_is_level_and_a_tone_is_found_where_it_is() {
        let mut impulse = vec![0.0; 4_000];
        impulse[17] = 0.5;
        let levels = smoothed_levels_db(&impulse, 48_000.0, &[20.0, 1_000.0, 23_000.0, 25_000.0], 1.0 / 3.0);
        assert!(levels[..3].iter().all(|level| (level + 6.02).abs() < 0.01), "{levels:?}");
        assert_eq!(levels[3], f64::NEG_INFINITY);
        let tone: Vec<f32> = (0..48_000).map(|i| (std::f64::consts::TAU * f64::from(i) / 48.0).sin() as f32).collect();
        let levels = smoothed_levels_db(&tone, 48_000.0, &[500.0, 1_000.0, 2_000.0], 1.0 / 3.0);
        assert!(levels[1] > levels[0] + 30.0 && levels[1] > levels[2] + 30.0, "{levels:?}");
    }
}
