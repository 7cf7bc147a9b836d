//! What walls and air do to an image, as a mix of first-order low-passes that all images share.
//!
//! A parallel filter with fixed poles (Bank, "Perceptually motivated audio equalization using fixed-pole parallel second-order
//! filters", IEEE Signal Processing Letters 15 (2008)), of first order: walls absorb smoothly over frequency.

use crate::minimum_phase::{LogGains, magnitude, phase};
use crate::number::single;
use promenade_fourier::num_complex::Complex64;
use std::f64::consts::TAU;

/// Corner frequencies of the low-passes, Hz.
const CORNERS_HZ: [f64; 5] = [125.0, 400.0, 1250.0, 3500.0, 10_000.0];
/// The sound itself, and its low-passes.
pub(crate) const BASES: usize = 1 + CORNERS_HZ.len();
/// Share of each basis.
pub(crate) type Weights = [f32; BASES];
/// Frequencies that the mix is fitted at, and their ends, Hz.
const FITTED: usize = 40;
const FITTED_HZ: (f64, f64) = (60.0, 18_000.0);

/// From gains to shares of bases, at one host rate.
pub(crate) struct WallFilters {
    /// Poles of the low-passes.
    pub(crate) poles: [f32; CORNERS_HZ.len()],
    /// Logarithm of the magnitude at each frequency and its phase, radians, by logarithm of each gain.
    targets: Vec<[LogGains; 2]>,
    /// Least-squares solution for real and imaginary parts of each frequency.
    solution: Vec<[Weights; 2]>,
}

impl WallFilters {
    pub(crate) fn new(sample_rate_hz: f64) -> Self {
        let poles = CORNERS_HZ.map(|hz| (-TAU * hz / sample_rate_hz).exp());
        let (low, high) = (FITTED_HZ.0, FITTED_HZ.1.min(0.4 * sample_rate_hz));
        let hz: Vec<f64> = (0..FITTED).map(|i| low * (high / low).powf(i as f64 / (FITTED - 1) as f64)).collect();
        let bases = |hz: f64| -> [Complex64; BASES] {
            let z = Complex64::cis(-TAU * hz / sample_rate_hz);
            let low_pass = |pole: f64| Complex64::from(1.0 - pole) / (Complex64::from(1.0) - z * pole);
            std::array::from_fn(|b| if b == 0 { Complex64::from(1.0) } else { low_pass(poles[b - 1]) })
        };
        let rows: Vec<[Complex64; BASES]> = hz.iter().map(|hz| bases(*hz)).collect();
        // An error of phase is one of delay, the greater the lower it is; an error of level is not. Errors weigh between the
        // two.
        let weight = |hz: f64| FITTED_HZ.0 / hz;
        let mut normal = [[0.0_f64; BASES]; BASES];
        for (row, hz) in rows.iter().zip(&hz) {
            for (i, a) in row.iter().enumerate() {
                row.iter().enumerate().for_each(|(j, b)| normal[i][j] += weight(*hz) * (a.conj() * b).re);
            }
        }
        // At low rates the highest low-passes are nearly the sound itself.
        (0..BASES).for_each(|i| normal[i][i] *= 1.0 + 1e-6);
        let inverse = inverse(normal);
        let solved = |part: [f64; BASES]| -> Weights {
            std::array::from_fn(|i| single(inverse[i].iter().zip(part).map(|(a, b)| a * b).sum()))
        };
        let of_row = |(row, hz): (&[Complex64; BASES], &f64)| {
            [row.map(|b| b.re), row.map(|b| b.im)].map(|part| solved(part.map(|b| weight(*hz) * b)))
        };
        let solution = rows.iter().zip(&hz).map(of_row).collect();
        let targets = hz.iter().map(|hz| [magnitude(*hz), phase(*hz)].map(|shares| shares.map(single))).collect();
        Self { poles: poles.map(single), targets, solution }
    }

    /// The shares that come nearest to gains with their minimum phase.
    pub(crate) fn weights(&self, log_gains: &LogGains) -> Weights {
        let mut weights = [0.0; BASES];
        let sum = |shares: &LogGains| shares.iter().zip(log_gains).map(|(a, g)| a * g).sum::<f32>();
        for ([magnitude, phase], [re, im]) in self.targets.iter().zip(&self.solution) {
            let (gain, (sin, cos)) = (sum(magnitude).exp(), sum(phase).sin_cos());
            for (w, (re, im)) in weights.iter_mut().zip(re.iter().zip(im)) {
                *w += gain * (cos * re + sin * im);
            }
        }
        weights
    }
}

/// Inverse of a symmetric positive matrix (Gauss and Jordan; no pivots are needed).
fn inverse(mut matrix: [[f64; BASES]; BASES]) -> [[f64; BASES]; BASES] {
    let mut out: [[f64; BASES]; BASES] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for i in 0..BASES {
        let scale = 1.0 / matrix[i][i];
        matrix[i].iter_mut().chain(&mut out[i]).for_each(|v| *v *= scale);
        let (row, other) = (matrix[i], out[i]);
        for j in (0..BASES).filter(|j| *j != i) {
            let factor = matrix[j][i];
            matrix[j].iter_mut().zip(row).for_each(|(v, r)| *v -= factor * r);
            out[j].iter_mut().zip(other).for_each(|(v, r)| *v -= factor * r);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::minimum_phase::GIVEN_HZ;

    /// Level of a mix at a frequency, dB.
    fn level_db(filters: &WallFilters, weights: &Weights, hz: f64, rate: f64) -> f64 {
        let z = Complex64::cis(-TAU * hz / rate);
        let low = |p: &f32| Complex64::from(1.0 - f64::from(*p)) / (Complex64::from(1.0) - z * f64::from(*p));
        let sum: Complex64 = weights[1..].iter().zip(&filters.poles).map(|(w, p)| low(p) * f64::from(*w)).sum();
        20.0 * (sum + f64::from(weights[0])).norm().log10()
    }

    #[test]
    fn walls_sound_as_their_octaves_say_at_every_rate() {
        // Amplitudes left by plaster, a carpet and a curtain, and by all three in turn.
        let plaster = [0.93, 0.93, 0.95, 0.97, 0.97, 0.98, 0.98, 0.98, 0.98_f32];
        let carpet = [0.99, 0.99, 0.97, 0.93, 0.79, 0.63, 0.59, 0.59, 0.59];
        let curtain = [0.96, 0.96, 0.83, 0.71, 0.5, 0.55, 0.63, 0.63, 0.63];
        // A panel that gives way at 63 Hz, and one at 125.
        let panel = [0.78, 0.9, 0.95, 0.97, 0.98, 0.98, 0.98, 0.98, 0.98];
        let resonant = [0.95, 0.8, 0.9, 0.95, 0.97, 0.98, 0.98, 0.98, 0.98];
        let all: LogGains = std::array::from_fn(|i| plaster[i] * carpet[i] * curtain[i]);
        // Of 20 m at 20 degrees and 50 %.
        let air = [1.0, 1.0, 1.0, 0.99, 0.99, 0.98, 0.93, 0.79, 0.47];
        for rate in [44_100.0, 48_000.0, 192_000.0] {
            let filters = WallFilters::new(rate);
            let sets = [[1.0; 9], [0.3; 9], plaster, carpet, curtain, all, panel, resonant].map(|walls| (walls, 1.0));
            for (gains, most) in sets.into_iter().chain([(air, 2.0)]) {
                let weights = filters.weights(&gains.map(f32::ln));
                for (hz, gain) in GIVEN_HZ.iter().zip(gains) {
                    let found = level_db(&filters, &weights, f64::from(*hz), rate);
                    let want = f64::from(20.0 * gain.log10());
                    assert!((found - want).abs() < most, "{rate} {hz}: {found} dB, {want}");
                }
            }
        }
    }
}
