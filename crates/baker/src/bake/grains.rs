//! How much energy of a measured response arrives when images do: grains of it, octave by octave, and the response without
//! them.

use crate::bake::ears::Ears;
use promenade_core::{OCTAVES, OCTAVES_HZ};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::signal;
use promenade_metrics::statistics::median_high;
use std::f64::consts::PI;

/// The lowest octave that grains are taken from: longer waves outlast them, and neighbouring responses agree in their phases.
pub(crate) const LOWEST: usize = 2;
/// How far a grain reaches to either side of an arrival, seconds.
const GRAIN_S: f64 = 0.0007;
/// Over how much, to either side, the energy that is no image's is taken, seconds; it is the median there.
const FLOOR_S: f64 = 0.004;
/// Of the energy in a grain, at least this share stays.
const LEAST_LEFT: f64 = 0.25;
/// Turns of the fit.
const TURNS: usize = 300;

/// Sound of both ears in the octaves from [`LOWEST`] on, and its energy smoothed over a grain, `[ear][octave][sample]`.
pub(crate) struct Grains {
    octaves: [Vec<Vec<f64>>; 2],
    energies: [Vec<Vec<f64>>; 2],
}

/// An image as a response would have it at a gain of 1.
pub(crate) struct Arrival {
    /// Sample of its arrival at the head's centre.
    pub(crate) at: usize,
    /// Its energy, smoothed over a grain, `[ear][octave][sample]`.
    pub(crate) energies: [Vec<Vec<f64>>; 2],
}

impl Grains {
    /// Of `len` samples with these spectra.
    pub(crate) fn of(ears: &Ears, spectra: [&[Complex64]; 2], len: usize) -> Self {
        let octaves = spectra.map(|spectrum| ears.octaves(spectrum, len));
        let energies = octaves.each_ref().map(|ear| ear.iter().map(|octave| smoothed(octave, ears.rate)).collect());
        Self { octaves, energies }
    }

    /// Their energy, without the sound.
    pub(crate) fn into_energies(self) -> [Vec<Vec<f64>>; 2] {
        self.energies
    }

    /// Gains of arrivals, as ratios of energies, `[octave][arrival]` from [`LOWEST`] on: least squares of the energy that is
    /// above what goes on around, in shares of what was measured, none negative and none above `most`, `[octave]`.
    pub(crate) fn gains(&self, arrivals: &[Arrival], most: &[f64], rate: f64) -> Vec<Vec<f64>> {
        let count = arrivals.len();
        let octave_gains = |octave: usize| {
            let (mut common, mut explained) = (vec![vec![0.0; count]; count], vec![0.0; count]);
            for ear in 0..2 {
                let energies = &self.energies[ear][octave];
                for arrival in arrivals {
                    let found = energies[arrival.at];
                    if found <= 0.0 {
                        continue;
                    }
                    let wanted = (found - floor(energies, arrival.at, rate)).max(0.0);
                    let here = |i: usize| arrivals[i].energies[ear][octave][arrival.at];
                    let row: Vec<f64> = (0..count).map(here).collect();
                    for (i, a) in row.iter().enumerate().filter(|(_, a)| **a > 0.0) {
                        explained[i] += a * wanted / found;
                        common[i].iter_mut().zip(&row).for_each(|(sum, b)| *sum += a * b / found);
                    }
                }
            }
            bounded(&common, &explained, most[octave])
        };
        (0..most.len()).map(octave_gains).collect()
    }

    /// What an ear loses where arrivals of these gains, as [`Grains::gains`] has them, are taken off, and energies by octave:
    /// of what it loses and of the arrivals, added to `moved`.
    pub(crate) fn lifted(&self, arrivals: &[Arrival], gains: &[Vec<f64>], ear: usize, moved: &mut [[f64; 2]]) -> Vec<f32> {
        let mut lost = vec![0.0; self.octaves[ear].first().map_or(0, Vec::len)];
        for ((octave, gains), moved) in gains.iter().enumerate().zip(moved) {
            let mut explained = vec![0.0; lost.len()];
            for (arrival, gain) in arrivals.iter().zip(gains).filter(|(_, gain)| **gain > 0.0) {
                explained.iter_mut().zip(&arrival.energies[ear][octave]).for_each(|(sum, energy)| *sum += gain * energy);
            }
            let sound = self.octaves[ear][octave].iter().zip(&self.energies[ear][octave]);
            for (lost, ((x, found), explained)) in lost.iter_mut().zip(sound.zip(explained)) {
                let left = if *found > 0.0 { (1.0 - explained / found).max(LEAST_LEFT) } else { 1.0 };
                *lost += x * (1.0 - left.sqrt());
                moved[0] += (1.0 - left) * found;
                moved[1] += explained;
            }
        }
        lost.into_iter().map(|x| x as f32).collect()
    }
}

impl Ears {
    /// The octaves from [`LOWEST`] on of a spectrum, as signals of `len` samples: neighbours overlap and sum to the sound. The
    /// highest that the rate has takes what is above it.
    fn octaves(&self, spectrum: &[Complex64], len: usize) -> Vec<Vec<f64>> {
        let last = self.last_octave();
        let octave = |octave: usize| {
            let weighed = spectrum.iter().enumerate().map(|(k, x)| {
                let place = (self.hz(k).max(1.0) / f64::from(OCTAVES_HZ[octave])).log2();
                let beside = if octave == last { place.min(0.0) } else { place };
                x * (0.5 * PI * (1.0 - beside.abs()).max(0.0)).sin().powi(2)
            });
            let mut samples = signal(weighed.collect(), self.n_fft);
            samples.truncate(len);
            samples
        };
        (LOWEST..=last).map(octave).collect()
    }

    /// The highest octave of which the rate has the better part.
    pub(crate) fn last_octave(&self) -> usize {
        (LOWEST..OCTAVES).rev().find(|octave| f64::from(OCTAVES_HZ[*octave]) < 0.4 * self.rate).unwrap_or(LOWEST)
    }
}

/// Energy of a signal under a Hann window around each sample.
fn smoothed(samples: &[f64], rate: f64) -> Vec<f64> {
    let reach = (GRAIN_S * rate) as usize;
    let window: Vec<f64> = (0..=2 * reach).map(|i| 0.5 - 0.5 * (PI * (i + 1) as f64 / (reach + 1) as f64).cos()).collect();
    let mut out = vec![0.0; samples.len()];
    for (i, x) in samples.iter().enumerate() {
        let energy = x * x;
        let from = i.saturating_sub(reach);
        for (at, sum) in out.iter_mut().enumerate().take(i + reach + 1).skip(from) {
            *sum += energy * window[at + reach - i];
        }
    }
    out
}

/// The median of energies around a sample.
fn floor(energies: &[f64], at: usize, rate: f64) -> f64 {
    let reach = (FLOOR_S * rate) as usize;
    let around = &energies[at.saturating_sub(reach)..(at + reach + 1).min(energies.len())];
    median_high(around.iter().copied()).unwrap_or(0.0)
}

/// Least squares from 0 to `most`, one unknown after the other.
fn bounded(common: &[Vec<f64>], explained: &[f64], most: f64) -> Vec<f64> {
    let mut gains = vec![0.0; explained.len()];
    for _ in 0..TURNS {
        for i in 0..gains.len() {
            let others: f64 = common[i].iter().zip(&gains).map(|(c, g)| c * g).sum::<f64>() - common[i][i] * gains[i];
            gains[i] = if common[i][i] > 0.0 { ((explained[i] - others) / common[i][i]).clamp(0.0, most) } else { 0.0 };
        }
    }
    gains
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_and_what_is_free_is_the_least() {
        let common = [vec![2.0, 1.0], vec![1.0, 2.0]];
        assert!(bounded(&common, &[4.0, 5.0], 9.0).iter().zip([1.0, 2.0]).all(|(a, b)| (a - b).abs() < 1e-9));
        assert_eq!(bounded(&common, &[4.0, 1.0], 1.5), [1.5, 0.0]);
    }

    #[test]
    fn the_energy_around_a_click_is_that_of_a_window() {
        let mut samples = vec![0.0; 200];
        samples[100] = 2.0;
        let energies = smoothed(&samples, 48_000.0);
        assert!((energies[100] - 4.0).abs() < 1e-9 && energies[60] == 0.0 && energies[110] > energies[130]);
        assert!((energies[83] - energies[117]).abs() < 1e-9);
        assert_eq!(floor(&energies, 100, 48_000.0), 0.0);
    }
}
