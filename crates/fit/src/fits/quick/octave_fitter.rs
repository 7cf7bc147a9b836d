//! One octave of a quick fit: Gauss-Newton, damped (Levenberg 1944).

use super::fit::OctaveFit;
use crate::bands::{Estimate, FITTED_HZ, JND, logistic, measures};
use crate::late::{BIN_S, Histories, LOUDSPEAKER_SHARPNESS, Octave, Surface};
use crate::numerics::solve;
use crate::room::BoxPath;
use rayon::prelude::*;

/// Unknowns of an octave: a logit for each wall, scattering's, and the logarithm of the sharpness.
const UNKNOWNS: usize = 8;
/// Steps at most.
const STEPS: usize = 12;
/// What is assumed of scattering: logit of 0.2, and its standard deviation.
const SCATTERING: (f64, f64) = (-1.4, 1.0);
/// Standard deviation of the logarithm of the sharpness of a source that faces somewhere.
const SHARPNESS_SD: f64 = 0.8;
/// Standard deviation of the mean logit of all walls: nothing is known.
const ANY: f64 = 3.0;
/// A logit that is known less than this much better than before is not determined by the data: share of the prior's standard
/// deviation.
const UNDETERMINED: f64 = 0.7;
/// No figure counts for more differences than this.
const MOST_JND: f64 = 20.0;
/// The least and greatest energy of images that the early residual makes of theirs.
const EARLY: (f64, f64) = (0.1, 4.0);

/// What one place tells of one octave: T20, EDT, C80 and level.
pub(super) struct Observed {
    pub(super) measured: [f64; 4],
    /// Between 80 and 250 ms.
    pub(super) late: f64,
}

/// A measurement's paths and facing.
pub(super) struct Images {
    pub(super) paths: Vec<BoxPath>,
    pub(super) facing: Option<[f64; 3]>,
}

/// Energy between 80 and 250 ms.
pub(super) fn late(bins: &[f64]) -> f64 {
    let at = |s: f64| ((s / BIN_S).round() as usize).min(bins.len());
    bins[at(0.08)..at(0.25)].iter().sum()
}

/// One octave while it is fitted.
pub(super) struct OctaveFitter<'a> {
    pub(super) histories: &'a Histories,
    pub(super) images: &'a [Images],
    pub(super) observed: Vec<&'a Observed>,
    pub(super) number: usize,
    pub(super) facing: bool,
}

impl OctaveFitter<'_> {
    fn model(&self, x: &[f64; UNKNOWNS]) -> Octave {
        let scattering = logistic(x[6]);
        Octave {
            surfaces: std::array::from_fn(|w| Surface { absorption: logistic(x[w]), scattering }),
            sharpness: x[7].exp(),
            air_per_m: self.histories.air.energy_decay_per_m(FITTED_HZ[self.number]),
            speed_m_s: self.histories.air.speed_m_s(),
        }
    }

    /// Energies at all places.
    fn energies(&self, x: &[f64; UNKNOWNS]) -> Vec<Vec<f64>> {
        let model = self.model(x);
        let diffuse = model.diffuse(self.histories, self.facing);
        self.images.iter().map(|images| model.at(&images.paths, images.facing, &diffuse)).collect()
    }

    /// What is left of each measure, in differences, and the level of the source in dB.
    fn residuals(&self, x: &[f64; UNKNOWNS]) -> (Vec<f64>, f64) {
        let found: Vec<[f64; 4]> = self.energies(x).iter().map(|e| measures(e, BIN_S)).collect();
        let gaps: Vec<f64> =
            found.iter().zip(&self.observed).map(|(f, h)| h.measured[3] - f[3]).filter(|g| g.is_finite()).collect();
        let level = gaps.iter().sum::<f64>() / gaps.len().max(1) as f64;
        let mut all = Vec::with_capacity(4 * found.len() + UNKNOWNS);
        for (f, h) in found.iter().zip(&self.observed) {
            let m = h.measured;
            // An early decay that direct sound makes short is noticed as a part of the whole decay.
            let edt = (f[1] - m[1]) / JND[1] / m[1].max(m[0]);
            let values = [(f[0] / m[0]).ln() / JND[0], edt, (f[2] - m[2]) / JND[2], (f[3] + level - m[3]) / JND[3]];
            // What was not measured says nothing; what the model does not have is as wrong as can be.
            let left = |(v, m): (f64, f64)| match (m.is_finite(), v.is_finite()) {
                (false, _) => 0.0,
                (true, false) => MOST_JND,
                _ => v.clamp(-MOST_JND, MOST_JND),
            };
            all.extend(values.into_iter().zip(m).map(left));
        }
        let mean = x[..6].iter().sum::<f64>() / 6.0;
        all.extend(x[..6].iter().map(|v| (v - mean) / std::f64::consts::LN_2));
        all.push(mean / ANY);
        all.push((x[6] - SCATTERING.0) / SCATTERING.1);
        all.push((x[7] - LOUDSPEAKER_SHARPNESS[self.number].ln()) / SHARPNESS_SD);
        (all, level)
    }

    fn start(&self) -> [f64; UNKNOWNS] {
        let mut x = [-1.5; UNKNOWNS];
        x[6] = SCATTERING.0;
        x[7] = LOUDSPEAKER_SHARPNESS[self.number].ln();
        x
    }

    pub(super) fn fit(&self) -> OctaveFit {
        let fitted = self.observed.iter().any(|h| h.measured[0].is_finite());
        let mut x = self.start();
        let size = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
        let (mut r, mut level) = self.residuals(&x);
        let mut damping = 0.1;
        for _ in 0..STEPS {
            if !fitted {
                break;
            }
            let (matrix, right) = self.normal(&x, &r);
            let mut improved = false;
            for _ in 0..4 {
                let damped: Vec<Vec<f64>> = (0..UNKNOWNS)
                    .map(|i| (0..UNKNOWNS).map(|j| matrix[i][j] * if i == j { 1.0 + damping } else { 1.0 }).collect())
                    .collect();
                let Some((step, _)) = solve(&damped, &right) else { break };
                let next: [f64; UNKNOWNS] = std::array::from_fn(|i| (x[i] - step[i].clamp(-1.0, 1.0)).clamp(-7.0, 7.0));
                let (next_r, next_level) = self.residuals(&next);
                if size(&next_r) < size(&r) {
                    improved = size(&r) - size(&next_r) > 1e-3 * size(&r);
                    (x, r, level) = (next, next_r, next_level);
                    damping *= 0.3;
                    break;
                }
                damping *= 4.0;
            }
            if !improved {
                break;
            }
        }
        self.result(&x, &r, level, fitted)
    }

    /// The normal equations of a step.
    fn normal(&self, x: &[f64; UNKNOWNS], r: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
        const STEP: f64 = 0.02;
        let columns: Vec<Vec<f64>> = (0..UNKNOWNS)
            .into_par_iter()
            .map(|i| {
                let mut moved = *x;
                moved[i] += STEP;
                self.residuals(&moved).0.iter().zip(r).map(|(a, b)| (a - b) / STEP).collect()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let matrix = columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
        (matrix, columns.iter().map(|a| dot(a, r)).collect())
    }

    fn result(&self, x: &[f64; UNKNOWNS], r: &[f64], level_db: f64, fitted: bool) -> OctaveFit {
        let count = 4 * self.images.len();
        let left_jnd = (r[..count].iter().map(|v| v * v).sum::<f64>() / count as f64).sqrt();
        let (matrix, _) = self.normal(x, r);
        let variances = solve(&matrix, &[0.0; UNKNOWNS]).map_or([f64::INFINITY; UNKNOWNS].to_vec(), |(_, v)| v);
        // Places of one room are alike, so that what is left counts for all of them together.
        let scale = left_jnd.max(1.0);
        let sd = |i: usize| scale * variances[i].sqrt();
        let share = |i: usize, prior: f64| Estimate::of_logit(x[i], sd(i), fitted && sd(i) < UNDETERMINED * prior);
        let prior = std::f64::consts::LN_2;
        let model = self.energies(x);
        let (mut late_db, mut decay, mut count) = (0.0, 0.0, 0.0);
        for (energies, observed) in model.iter().zip(&self.observed) {
            let gap = 10.0 * (observed.late / late(energies)).log10() - level_db;
            let ratio = observed.measured[0] / measures(energies, BIN_S)[0];
            if gap.is_finite() && ratio.is_finite() && ratio > 0.0 {
                late_db += gap;
                decay += ratio.ln();
                count += 1.0;
            }
        }
        let late_db = if count > 0.0 { late_db / count } else { 0.0 };
        let early_db = self.early_db(x, level_db, late_db);
        OctaveFit {
            residual_early_db: early_db,
            absorption: std::array::from_fn(|w| share(w, prior)),
            scattering: share(6, SCATTERING.1),
            sharpness: Estimate {
                value: if self.facing { x[7].exp() } else { 0.0 },
                error: sd(7) * x[7].exp(),
                determined: self.facing && fitted && sd(7) < UNDETERMINED * SHARPNESS_SD,
            },
            level_db,
            residual_db: late_db,
            residual_decay: if count > 0.0 { (decay / count).exp() } else { 1.0 },
            left_jnd,
            fitted,
        }
    }

    /// By how much all images together have to be stronger for the measured energy of the first 80 ms.
    fn early_db(&self, x: &[f64; UNKNOWNS], level_db: f64, late_db: f64) -> f64 {
        let model = self.model(x);
        let diffuse = model.diffuse(self.histories, self.facing);
        let (level, gain) = (10f64.powf(level_db / 10.0), 10f64.powf(late_db / 10.0));
        let early = |bins: &[f64]| bins.iter().take((0.08 / BIN_S).round() as usize).sum::<f64>();
        let (mut missing, mut predicted) = (0.0, 0.0);
        for (images, observed) in self.images.iter().zip(&self.observed) {
            let [_, _, c80, whole_db] = observed.measured;
            let measured = 10f64.powf(whole_db / 10.0) / (1.0 + 10f64.powf(-c80 / 10.0)) / level;
            let (direct, all) = images.paths.split_at(1.min(images.paths.len()));
            let direct: f64 = direct.iter().map(|p| model.energy(p, images.facing)).sum();
            let rest = early(&model.at(&images.paths[..1.min(images.paths.len())], images.facing, &diffuse)) - direct;
            let end = images.paths.first().map_or(0.0, |p| p.length_m) + 0.08 * model.speed_m_s;
            let own: f64 = all.iter().filter(|p| p.length_m < end).map(|p| model.energy(p, images.facing)).sum();
            if measured.is_finite() {
                // Places count alike, however near the source is.
                missing += (measured - direct - gain * rest) / measured;
                predicted += own / measured;
            }
        }
        10.0 * (missing / predicted).clamp(EARLY.0, EARLY.1).log10()
    }
}
