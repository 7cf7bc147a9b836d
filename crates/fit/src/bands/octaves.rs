//! A response in octaves whose energies add up to that of the whole.

use promenade_fourier::{signal, spectrum};
use promenade_metrics::{Line, backward_integral, onset, slope};
use std::f64::consts::FRAC_PI_2;

/// Octaves that are fitted, hertz: one more below those that materials have, so that these are not mistaken for what is deeper.
pub const FITTED_HZ: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
/// Seconds before the direct sound that belong to it: octave filters ring before it.
pub(crate) const LEAD_S: f64 = 0.002;
/// Octaves over which the edge of a band falls.
const EDGE: f64 = 1.0 / 3.0;

/// How many octaves a sample rate holds.
#[must_use]
pub(crate) fn octaves_at(sample_rate_hz: f64) -> usize {
    FITTED_HZ.iter().filter(|hz| **hz <= 0.5 * sample_rate_hz).count()
}

/// Amplitude that an octave of [`split`] has at a frequency.
#[must_use]
pub(crate) fn share(octave: usize, hz: f64, sample_rate_hz: f64) -> f64 {
    let from = (hz / FITTED_HZ[octave]).log2();
    let open = (octave == 0 && from < 0.0) || (octave + 1 == octaves_at(sample_rate_hz) && from > 0.0);
    let out = if open { 0.0 } else { ((from.abs() - 0.5) / EDGE + 0.5).clamp(0.0, 1.0) };
    (FRAC_PI_2 * out).cos()
}

/// Octaves of a signal, as long as it and not delayed. The lowest has all that is below it too, the highest all that is above.
#[must_use]
pub(crate) fn split(x: &[f32], sample_rate_hz: f64) -> Vec<Vec<f32>> {
    let count = octaves_at(sample_rate_hz);
    let length = (2 * x.len()).next_power_of_two().max(2);
    let bins = spectrum(x.iter().map(|v| f64::from(*v)), length);
    let octave = |o: usize| {
        let mut own = bins.clone();
        own.iter_mut()
            .enumerate()
            .for_each(|(k, bin)| *bin *= share(o, k as f64 * sample_rate_hz / length as f64, sample_rate_hz));
        signal(own, length).into_iter().take(x.len()).map(|v| v as f32).collect()
    };
    (0..count).map(octave).collect()
}

/// Energy of a signal.
pub(crate) fn energy(x: &[f32]) -> f64 {
    x.iter().map(|v| f64::from(*v).powi(2)).sum()
}

/// Decibels of an energy, -300 at least.
pub(crate) fn db(energy: f64) -> f64 {
    10.0 * energy.max(1e-30).log10()
}

/// Energy of a signal by octave, dB.
pub(crate) fn octave_energies_db(x: &[f32], sample_rate_hz: f64) -> Vec<f64> {
    split(x, sample_rate_hz).iter().map(|octave| db(energy(octave))).collect()
}

/// T20 and EDT in seconds, C80 and level in dB, of energies by bin from the direct sound on; NaN where there is none.
#[must_use]
pub(crate) fn measures(energies: &[f64], bin_s: f64) -> [f64; 4] {
    let left = backward_integral(energies.iter().copied());
    let sum = left.first().copied().unwrap_or(0.0);
    let db: Vec<f64> = left.iter().map(|e| 10.0 * (e / sum).max(1e-30).log10()).collect();
    // From a line of least squares.
    let inside = db.iter().enumerate().filter(|(_, d)| (-25.0..=-5.0).contains(*d));
    let points: Vec<(f64, f64)> = inside.map(|(i, d)| (i as f64 * bin_s, *d)).collect();
    let whole = db.last().is_some_and(|d| *d <= -25.0);
    let t20 = slope(&points).filter(|s| *s < 0.0 && whole && points.len() > 2).map_or(f64::NAN, |s| -60.0 / s);
    // From where the decay crosses -10 dB, since strong direct sound leaves no points for a line.
    let crossing = db.windows(2).position(|pair| pair[0] > -10.0 && pair[1] <= -10.0);
    let edt = crossing.map_or(f64::NAN, |i| 6.0 * bin_s * (i as f64 + (db[i] + 10.0) / (db[i] - db[i + 1])));
    let early = (0.08 / bin_s).round() as usize;
    let late = left.get(early).copied().unwrap_or(0.0);
    [t20, edt, 10.0 * ((sum - late).max(1e-30) / late.max(1e-30)).log10(), 10.0 * sum.max(1e-30).log10()]
}

/// Parts of a response of which the last two tell whether it ends in noise, and the ratio of their energies from which on it is
/// a decay: in short parts low octaves have few degrees of freedom.
const ENDS: [(usize, f64); 2] = [(10, 1.35), (5, 1.6)];
/// Energy over that of the noise, down to which a decay is taken as measured; beyond it, it goes on as it did over so many
/// decibels before.
const OVER_NOISE: f64 = 2.5;
const LINE_DB: f64 = 12.0;
/// Decay that has to be measured for a T20, dB.
const REACHED_DB: f64 = 25.0;

/// Energies by bin without the noise that they end in, and their measures as [`measures`] has them. The noise's energy is taken
/// off, and from where a decay meets it, it goes on along its line (after Lundeby et al. 1995). Responses that end before they
/// meet their noise stay as they are.
#[must_use]
pub(crate) fn without_noise(bins: &[f64], bin_s: f64) -> (Vec<f64>, [f64; 4]) {
    // What is padded with zeros is no noise.
    let length = bins.iter().rposition(|e| *e > 0.0).map_or(0, |i| i + 1);
    let mean = |from: usize, to: usize| bins[from..to].iter().sum::<f64>() / (to - from).max(1) as f64;
    let level = |(parts, flat): (usize, f64)| {
        let piece = length / parts;
        let (before, last) = (mean(length - 2 * piece, length - piece), mean(length - piece, length));
        (piece >= 4 && before < flat * last).then_some(0.5 * (before + last))
    };
    let Some(noise) = ENDS.into_iter().rev().find_map(level) else { return (bins.to_vec(), measures(bins, bin_s)) };
    let loudest = (0..length).max_by(|a, b| bins[*a].total_cmp(&bins[*b])).unwrap_or(0);
    let smooth = |i: usize| mean(i.saturating_sub(3), (i + 4).min(length));
    let end = (loudest + 1..length).find(|i| smooth(*i) < OVER_NOISE * noise).unwrap_or(length);
    let mut clear: Vec<f64> = bins.iter().map(|e| (e - noise).max(0.0)).collect();
    clear[end..].fill(0.0);
    let db = |i: usize| 10.0 * (smooth(i) - noise).max(1e-3 * noise).log10();
    let from = (loudest..end).rev().find(|i| db(*i) > db(end.saturating_sub(1)) + LINE_DB).unwrap_or(loudest);
    let points: Vec<(f64, f64)> = (from..end).map(|i| (i as f64, db(i))).collect();
    if let Some(line) = Line::through(&points).filter(|line| line.slope < 0.0) {
        clear.iter_mut().enumerate().skip(end).for_each(|(i, e)| *e = 10f64.powf(0.1 * line.at(i as f64)));
    }
    let (total, beyond) = (clear.iter().sum::<f64>(), clear[end..].iter().sum::<f64>());
    let mut found = measures(&clear, bin_s);
    if 10.0 * (total / beyond.max(1e-300)).log10() < REACHED_DB {
        found[0] = f64::NAN;
    }
    (clear, found)
}

/// Energies of a response by octave and bin from its first loud sample on, as [`without_noise`] has them, with their measures.
pub(crate) fn octave_decays(samples: &[f32], rate_hz: f64, bin_s: f64) -> Vec<(Vec<f64>, [f64; 4])> {
    let bin = (bin_s * rate_hz).round() as usize;
    let start = onset(samples).unwrap_or(0).saturating_sub((LEAD_S * rate_hz) as usize);
    split(samples, rate_hz).iter().map(|x| without_noise(&binned(x, start, bin), bin_s)).collect()
}

/// Energies of a response by bin, from a sample on.
#[must_use]
pub(crate) fn binned(x: &[f32], from: usize, samples: usize) -> Vec<f64> {
    let rest = x.get(from..).unwrap_or_default();
    rest.chunks(samples.max(1)).map(energy).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Random;

    #[test]
    fn octaves_have_the_energy_of_the_whole() {
        let mut random = Random::new(1, 0);
        let x: Vec<f32> = (0..8192).map(|_| random.normal() as f32).collect();
        let energy = |x: &[f32]| x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
        let all: f64 = split(&x, 16_000.0).iter().map(|o| energy(o)).sum();
        assert!((all / energy(&x) - 1.0).abs() < 0.01, "{all}");
        assert_eq!(split(&x, 16_000.0).len(), 8);
    }

    #[test]
    fn noise_at_the_end_changes_no_measure() {
        let mut random = Random::new(3, 0);
        let mut decay = |t60: f64, noise: f64| -> Vec<f64> {
            let bin = |i: u32| {
                let e = (-6.0 * std::f64::consts::LN_10 * f64::from(i) * 0.004 / t60).exp();
                // Energies of noise of 30 degrees of freedom.
                let rough = (0..30).map(|_| random.normal().powi(2)).sum::<f64>() / 30.0;
                (e + noise) * rough
            };
            (0..250).map(bin).collect()
        };
        for noise in [1e-5, 1e-4, 5e-4] {
            let bins = decay(0.5, noise);
            let ([t20, ..], raw) = (without_noise(&bins, 0.004).1, measures(&bins, 0.004)[0]);
            assert!((t20 / 0.5 - 1.0).abs() < 0.08, "{noise}: {t20}, {raw} as it is");
        }
        assert!(without_noise(&decay(0.5, 0.03), 0.004).1[0].is_nan(), "15 dB over the noise are no T20");
        let silent = decay(0.3, 0.0);
        assert_eq!(without_noise(&silent, 0.004).0, silent);
    }

    #[test]
    fn an_exponential_has_its_measures() {
        let bin_s = 0.002;
        let e: Vec<f64> = (0..800).map(|i| (-6.0 * std::f64::consts::LN_10 * f64::from(i) * bin_s / 0.5).exp()).collect();
        let [t20, edt, c80, _] = measures(&e, bin_s);
        let q = (-6.0 * std::f64::consts::LN_10 * 0.08 / 0.5).exp();
        assert!((t20 - 0.5).abs() < 1e-3 && (edt - 0.5).abs() < 1e-3);
        assert!((c80 - 10.0 * ((1.0 - q) / q).log10()).abs() < 0.01);
        assert!(measures(&e[..20], bin_s)[0].is_nan(), "it ends too early");
    }
}
