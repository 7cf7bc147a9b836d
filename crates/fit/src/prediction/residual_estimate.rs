//! The residual of a fitted room, from measurements.
//!
//! Energies in pieces of 4 ms are, at all places together, those of images times a share and those of rays times a curve: the
//! share by least squares over the first 80 ms, the curve as what is then left in the median over places, smoothed, and along a
//! line where noise has the rest.

use super::predict::Prediction;
use super::residual::Residual;
use crate::bands::{BANDS, FITTED_HZ, LEAD_S, binned, energy, split, without_noise};
use crate::late::BIN_S;
use crate::measurements::{Measurement, Measurements};
use promenade_metrics::Line;
use promenade_metrics::statistics::median;
use rayon::prelude::*;
use std::ops::Range;

/// Draws of images that are not in step.
const DRAWS: usize = 2;
/// Bins that tell images from diffuse sound: to 80 ms.
const EARLY: usize = 20;
/// Rounds in which shares and curve are found after each other.
const PASSES: usize = 3;
/// Bins before and after which energies are levelled, 50 ms, and by how much at most.
const CLEAR: usize = 12;
const MOST_LEVELLED: f64 = 2.0;
/// From here on the chain's window tells the direct sound's energy, hertz; below, it has walls in it.
const DIRECT_HZ: f64 = 400.0;
/// The greatest energy of the direct sound over what the chain says, where it is not known.
const MOST_DIRECT: f64 = 2.0;
/// The greatest energy of images over what surfaces say.
const MOST_IMAGES: f64 = 2.0;
/// Diffuse sound has at least this share of what is measured.
const LEAST_DIFFUSE: f64 = 0.05;
/// Decay down to which the curve is measured, and from which its line is drawn, dB below all of the energy.
const MEASURED_DB: (f64, f64) = (-30.0, -12.0);
/// Bins on either side that the curve is smoothed over where it is late; from its beginning on it is ever more.
const SMOOTHED: usize = 6;

/// Energies of one place in one octave by bin: measured, of the direct sound, of images, of rays.
struct Energies {
    measured: Vec<f64>,
    direct: Vec<f64>,
    images: Vec<f64>,
    rays: Vec<f64>,
}

impl Prediction<'_> {
    /// What is left of measurements beside what is predicted without it.
    pub(crate) fn residual_of(&self, set: &Measurements) -> Residual {
        let places: Vec<Vec<Energies>> = set.all.par_iter().map(|m| energies(self, m, f64::from(set.sample_rate_hz))).collect();
        let octaves = places.first().map_or(0, Vec::len);
        let of = |o: usize| octave(&places.iter().map(|p| &p[o]).collect::<Vec<_>>(), FITTED_HZ[o] > DIRECT_HZ);
        let each: Vec<([f64; 2], Vec<f64>)> = (0..octaves).into_par_iter().map(of).collect();
        Residual {
            direct: each.iter().map(|e| e.0[0]).collect(),
            images: each.iter().map(|e| e.0[1]).collect(),
            diffuse: each.into_iter().map(|e| e.1).collect(),
        }
    }
}

fn energies(bare: &Prediction<'_>, m: &Measurement, rate_hz: f64) -> Vec<Energies> {
    let bin = (BIN_S * rate_hz).round() as usize;
    let from = bare.arrival(m);
    let lead = (LEAD_S * rate_hz) as usize;
    let bins = |x: &[f32]| -> Vec<Vec<f64>> {
        let of = |x: &Vec<f32>| {
            let mut bins = binned(x, from, bin);
            // Octave filters ring before the direct sound.
            let before = energy(&x[from.saturating_sub(lead).min(x.len())..from.min(x.len())]);
            bins.first_mut().into_iter().for_each(|b| *b += before);
            bins
        };
        split(x, rate_hz).iter().map(of).collect()
    };
    let measured: Vec<Vec<f64>> = bins(&m.samples).iter().map(|bins| without_noise(bins, BIN_S).0).collect();
    let direct = bins(&bare.images(m, 0, &[[1.0; BANDS], [0.0; BANDS]]));
    let mut images: Vec<Vec<f64>> = direct.iter().map(|d| vec![0.0; d.len()]).collect();
    for draw in 0..DRAWS {
        for ((sum, own), direct) in images.iter_mut().zip(bins(&bare.images(m, draw, &[[1.0; BANDS]; 2]))).zip(&direct) {
            for ((s, o), d) in sum.iter_mut().zip(own).zip(direct) {
                *s += (o - d) / DRAWS as f64;
            }
        }
    }
    let rays = (0..measured.len()).map(|o| bare.rays(m, o));
    let all = measured.into_iter().zip(direct).zip(images).zip(rays);
    all.map(|(((measured, direct), images), rays)| Energies { measured, direct, images, rays }).collect()
}

/// Energies of the direct sound and of images over what the fit says, and the curve of diffuse sound, of one octave.
fn octave(places: &[&Energies], direct_known: bool) -> ([f64; 2], Vec<f64>) {
    let bins = places.iter().map(|p| p.measured.len()).max().unwrap_or(0);
    let (matrix, right) = normal_equations(places, usize::from(direct_known)..EARLY);
    let (mut direct, mut images, mut curve) = (1.0, 1.0, vec![1.0; bins]);
    for _ in 0..PASSES {
        [direct, images, _] = shares(&matrix, &right, direct_known.then_some(direct));
        curve = (0..bins)
            .map(|t| {
                let over_rays = |p: &&Energies| {
                    let measured = at(&p.measured, t);
                    let left = measured - direct * at(&p.direct, t) - images * at(&p.images, t);
                    left.max(LEAST_DIFFUSE * measured) / at(&p.rays, t).max(1e-30)
                };
                median(places.iter().map(over_rays)).unwrap_or(1.0)
            })
            .collect();
        // The direct sound's own bin says little of what is diffuse.
        if let [first, second, ..] = &mut curve[..] {
            *first = *second;
        }
        curve = smooth(&curve);
        if direct_known {
            let own = |p: &&Energies| {
                let others = images * at(&p.images, 0) + at(&curve, 0) * at(&p.rays, 0);
                (at(&p.measured, 0) - others) / at(&p.direct, 0).max(1e-30)
            };
            direct = median(places.iter().map(own)).unwrap_or(1.0).clamp(1.0 / MOST_DIRECT, MOST_DIRECT);
        }
    }
    let measured: Vec<f64> = (0..bins).map(|t| mean_measured(places, t)).collect();
    let mut curve = extended(&curve, &measured);
    for range in [0..CLEAR.min(bins), CLEAR.min(bins)..bins] {
        let gain = levelled(places, [direct, images], &curve, range.clone());
        curve[range].iter_mut().for_each(|c| *c *= gain);
    }
    ([direct, images], curve)
}

fn at(energies: &[f64], bin: usize) -> f64 {
    energies.get(bin).copied().unwrap_or(0.0)
}

fn mean_measured(places: &[&Energies], bin: usize) -> f64 {
    places.iter().map(|p| at(&p.measured, bin)).sum::<f64>() / places.len().max(1) as f64
}

/// The normal equations of what was measured as a sum of direct sound, images and rays.
fn normal_equations(places: &[&Energies], bins: Range<usize>) -> ([[f64; 3]; 3], [f64; 3]) {
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for t in bins {
        for p in places {
            // Every piece of time of every place counts alike.
            let scale = (at(&p.measured, t) + mean_measured(places, t)).max(1e-30).powi(-2);
            let row = [at(&p.direct, t), at(&p.images, t), at(&p.rays, t)];
            for i in 0..3 {
                right[i] += scale * row[i] * at(&p.measured, t);
                (0..3).for_each(|j| matrix[i][j] += scale * row[i] * row[j]);
            }
        }
    }
    (matrix, right)
}

/// What the curve is times in some bins so that energies there are right in the mean of decibels over places: a median of
/// energies is less than their mean, and more so the fewer there are.
fn levelled(places: &[&Energies], [direct, images]: [f64; 2], curve: &[f64], bins: Range<usize>) -> f64 {
    let off_db = |k: f64| -> f64 {
        let own = |p: &&Energies| {
            let known = |t: usize| direct * at(&p.direct, t) + images * at(&p.images, t);
            let found: f64 = bins.clone().map(|t| known(t) + k * curve[t] * at(&p.rays, t)).sum();
            10.0 * (found.max(1e-30) / bins.clone().map(|t| at(&p.measured, t)).sum::<f64>().max(1e-30)).log10()
        };
        places.iter().map(own).sum()
    };
    let (mut low, mut high): (f64, f64) = (1.0 / MOST_LEVELLED, MOST_LEVELLED);
    for _ in 0..30 {
        let middle = (low * high).sqrt();
        if off_db(middle) > 0.0 { high = middle } else { low = middle }
    }
    (low * high).sqrt()
}

/// Least squares with no share below 0 and none beyond what is held possible, one share after the other; the first may be
/// known.
fn shares(matrix: &[[f64; 3]; 3], right: &[f64; 3], first: Option<f64>) -> [f64; 3] {
    let most = [MOST_DIRECT, MOST_IMAGES, f64::INFINITY];
    let mut x = [first.unwrap_or(1.0), 0.5, 0.5];
    for _ in 0..500 {
        for i in usize::from(first.is_some())..3 {
            let others: f64 = (0..3).filter(|j| *j != i).map(|j| matrix[i][j] * x[j]).sum();
            if matrix[i][i] > 0.0 {
                x[i] = ((right[i] - others) / matrix[i][i]).clamp(0.0, most[i]);
            }
        }
    }
    x
}

/// Geometric means over ever more bins.
fn smooth(curve: &[f64]) -> Vec<f64> {
    (0..curve.len())
        .map(|t| {
            let half = (t / 4).min(SMOOTHED);
            let near = &curve[t - half..(t + half + 1).min(curve.len())];
            (near.iter().map(|v| v.max(1e-12).ln()).sum::<f64>() / near.len() as f64).exp()
        })
        .collect()
}

/// The curve with a line from where the measured decay ends.
fn extended(curve: &[f64], measured: &[f64]) -> Vec<f64> {
    let total: f64 = measured.iter().sum();
    let mut left = total;
    let (mut from, mut until) = (curve.len(), curve.len());
    for (t, e) in measured.iter().enumerate() {
        let db = 10.0 * (left / total.max(1e-300)).max(1e-30).log10();
        if db < MEASURED_DB.1 {
            from = from.min(t);
        }
        if db < MEASURED_DB.0 {
            until = t;
            break;
        }
        left -= e;
    }
    let points: Vec<(f64, f64)> = (from..until).map(|t| (t as f64, curve[t].ln())).collect();
    let Some(line) = Line::through(&points).filter(|line| line.slope.is_finite()) else { return curve.to_vec() };
    (0..curve.len()).map(|t| if t < until { curve[t] } else { line.at(t as f64).exp() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_images_and_rays_are_found_and_noise_is_not_followed() {
        let rays: Vec<f64> = (0..200).map(|t| (-f64::from(t) / 12.0).exp()).collect();
        let place = |k: u32| {
            let images: Vec<f64> = (0..200)
                .map(|t| if t > 0 && t < 40 { 2.0 * f64::from((t * (k + 3)) % 5) * (-f64::from(t) / 8.0).exp() } else { 0.0 })
                .collect();
            let measured =
                images.iter().zip(&rays).enumerate().map(|(t, (i, r))| 0.3 * i + 0.7 * r * (-(t as f64) / 100.0).exp() + 1e-6);
            Energies { measured: measured.collect(), direct: vec![0.0; 200], images, rays: rays.clone() }
        };
        let places: Vec<Energies> = (0..4).map(place).collect();
        let ([_, images], curve) = octave(&places.iter().collect::<Vec<_>>(), true);
        assert!((images - 0.3).abs() < 0.03, "{images}");
        for t in [5_usize, 30, 60, 150] {
            let meant = 0.7 * (-(t as f64) / 100.0).exp();
            assert!((curve[t] / meant - 1.0).abs() < 0.12, "{t}: {} {meant}", curve[t]);
        }
    }
}
