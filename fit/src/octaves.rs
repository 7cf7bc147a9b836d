//! A response in octaves whose energies add up to that of the whole.

use promenade_fourier::{signal, spectrum};
use promenade_metrics::slope;
use std::f64::consts::FRAC_PI_2;

/// Octaves that are fitted, hertz: one more below those that materials have, so that these are not mistaken for what is deeper.
pub const FITTED_HZ: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
/// Octaves over which the edge of a band falls.
const EDGE: f64 = 1.0 / 3.0;
/// Just noticeable differences that figures are counted in: of reverberation times as a share, of clarity and level in dB (ISO
/// 3382-1).
pub(crate) const JND: [f64; 4] = [0.05, 0.05, 1.0, 1.0];

/// How many octaves a sample rate holds.
#[must_use]
pub(crate) fn octaves_at(sample_rate_hz: f64) -> usize {
    FITTED_HZ.iter().filter(|hz| **hz <= 0.5 * sample_rate_hz).count()
}

/// Octaves of a signal, as long as it and not delayed. The lowest has all that is below it too, the highest all that is above.
#[must_use]
pub(crate) fn split(x: &[f32], sample_rate_hz: f64) -> Vec<Vec<f32>> {
    let count = octaves_at(sample_rate_hz);
    let length = (2 * x.len()).next_power_of_two().max(2);
    let bins = spectrum(x.iter().map(|v| f64::from(*v)), length);
    let octave = |o: usize| {
        let mut own = bins.clone();
        for (k, bin) in own.iter_mut().enumerate() {
            let from = (k as f64 * sample_rate_hz / length as f64 / FITTED_HZ[o]).log2();
            let open = (o == 0 && from < 0.0) || (o + 1 == count && from > 0.0);
            let out = if open { 0.0 } else { ((from.abs() - 0.5) / EDGE + 0.5).clamp(0.0, 1.0) };
            *bin *= (FRAC_PI_2 * out).cos();
        }
        signal(own, length).into_iter().take(x.len()).map(|v| v as f32).collect()
    };
    (0..count).map(octave).collect()
}

/// T20 and EDT in seconds, C80 and level in dB, of energies by bin from the direct sound on; NaN where there is none.
#[must_use]
pub(crate) fn measures(energies: &[f64], bin_s: f64) -> [f64; 4] {
    let mut left = energies.to_vec();
    let mut sum = 0.0;
    for e in left.iter_mut().rev() {
        sum += *e;
        *e = sum;
    }
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

/// Energies of a response by bin, from a sample on.
#[must_use]
pub(crate) fn binned(x: &[f32], from: usize, samples: usize) -> Vec<f64> {
    let rest = x.get(from..).unwrap_or_default();
    rest.chunks(samples.max(1)).map(|c| c.iter().map(|v| f64::from(*v).powi(2)).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

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
