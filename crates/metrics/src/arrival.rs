//! The direct sound in the responses of two ears.

use crate::running_itd_s;
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};

/// Band in which the direct sound is looked for, hertz.
const LOWEST_HZ: f64 = 150.0;
const HIGHEST_HZ: f64 = 7000.0;
/// The first arrival is the first at least so strong, a share of the strongest one's power.
const FIRST: f64 = 0.3;
/// What is cut out around an arrival, seconds before and after it.
const BEFORE_S: f64 = 0.0015;
const AFTER_S: f64 = 0.0020;
/// Share of the time before an arrival over which the cut has soft edges.
const EDGE: f64 = 0.3;
/// Energies are summed over this on both sides; an arrival rises to its peak within the second, seconds.
const SMOOTH_S: f64 = 0.0003;
const RISE_S: f64 = 0.0008;

/// The direct sound of a pair of responses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Delay between the ears, seconds, positive = left ear later.
    pub delay_s: f64,
    /// Energy of both ears, dB.
    pub level_db: f64,
    /// When it comes, seconds after the responses' first sample, mean of both ears.
    pub time_s: f64,
    /// How far it stands out of the mean of all that is in the responses, dB.
    pub clarity_db: f64,
}

/// The first strong arrival of responses, measured or found by [`crate::deconvolve`]; `None` where there is none, or the ears
/// differ in length.
///
/// It is cut out of both ears, and its delay between them is that of running sound ([`running_itd_s`]).
#[must_use]
pub fn arrival(ears: [&[f32]; 2], sample_rate_hz: f64) -> Option<Arrival> {
    let count = ears[0].len();
    if count == 0 || ears[1].len() != count {
        return None;
    }
    let rate = sample_rate_hz;
    let [before, after] = [BEFORE_S, AFTER_S].map(|s| (s * rate).round() as usize);
    let length = (count + before + after).next_power_of_two();
    let inside = |k: usize| (LOWEST_HZ..=HIGHEST_HZ.min(0.45 * rate)).contains(&(k as f64 * rate / length as f64));
    let responses = ears.map(|ear| {
        let mut bins = spectrum(ear.iter().map(|&v| f64::from(v)), length);
        bins.iter_mut().enumerate().filter(|(k, _)| !inside(*k)).for_each(|(_, x)| *x = Complex64::default());
        signal(bins, length)
    });
    // Beyond both ends is what the band's edges leave there: the transform's other end, where zeros were.
    let at = |ear: usize, i: i64| responses[ear][i.rem_euclid(length as i64) as usize];
    let power = |i: i64| at(0, i).powi(2) + at(1, i).powi(2);
    let half = ((SMOOTH_S * rate).round() as i64).max(1);
    let smooth: Vec<f64> = (0..count as i64).map(|i| (i - half..=i + half).map(power).sum()).collect();
    let strongest = smooth.iter().copied().fold(0.0, f64::max);
    if strongest <= 0.0 {
        return None;
    }
    let mean = smooth.iter().sum::<f64>() / count as f64;
    let onset = smooth.iter().position(|p| *p >= FIRST * strongest)?;
    let until = (onset + (RISE_S * rate) as usize + 1).min(count);
    let peak = (onset..until).max_by(|a, b| smooth[*a].total_cmp(&smooth[*b]))?;
    let centre = peak as i64;
    let pieces = [0, 1].map(|ear| -> Vec<f64> {
        let window = |i: usize| {
            let inside = i.min(before + after - i) as f64 / (EDGE * before as f64);
            (0.5 * std::f64::consts::PI * inside.min(1.0)).sin().powi(2)
        };
        (0..=before + after).map(|i| window(i) * at(ear, centre + i as i64 - before as i64)).collect()
    });
    let energy: f64 = pieces.iter().flatten().map(|v| v * v).sum();
    // The centre of the energy around the peak is finer than a sample.
    let around = || (centre - 2 * half..=centre + 2 * half).map(|i| (i as f64, power(i)));
    let middle = around().map(|(i, p)| i * p).sum::<f64>() / around().map(|(_, p)| p).sum::<f64>();
    Some(Arrival {
        delay_s: running_itd_s(pieces.each_ref().map(Vec::as_slice), rate)?,
        level_db: 10.0 * energy.log10(),
        time_s: middle / rate,
        clarity_db: 10.0 * (smooth[peak] / mean).log10(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::{decaying_noise, pulse};

    #[test]
    fn the_first_arrival_counts_and_louder_reflections_do_not() {
        let rate = 48_000.0;
        let sum = |direct: f64, echo: f64, tail: u64| -> Vec<f32> {
            let (direct, echo) = (pulse(direct, 9600), pulse(echo, 9600));
            let late = decaying_noise(tail, 0.4, 0.17, rate);
            let room = |i: usize| i.checked_sub(1000).and_then(|i| late.get(i)).map_or(0.0, |v| 0.02 * v);
            (0..9600).map(|i| direct[i] + 1.3 * echo[i] + room(i)).collect()
        };
        // The left ear is 12 samples late in the direct sound and early in the reflection.
        let found = arrival([&sum(612.0, 850.0, 1), &sum(600.0, 870.0, 2)], rate).unwrap();
        assert!((found.delay_s - 12.0 / rate).abs() < 5e-6, "{found:?}");
        assert!((found.time_s - 606.0 / rate).abs() < 1e-4 && found.clarity_db > 10.0, "{found:?}");
        assert_eq!(arrival([&[0.0; 100], &[0.0; 100]], rate), None);
        assert_eq!(arrival([&[0.0; 100], &[0.0; 99]], rate), None);
    }
}
