//! The quick fit: absorption of each wall by octave from T20, EDT, C80 and level, in just noticeable differences.
//!
//! One trace of rays serves all of it ([`Histories`]). By octave the unknowns are absorption of six walls, scattering, and how
//! much the source sends beside its axis; Gauss-Newton with derivatives by steps, damped (Levenberg 1944). Walls are held
//! together by a prior: a factor of 2 of one against their mean costs one difference.

mod finish;

pub use finish::quick_fit;

use crate::energy_model::{BIN_S, ORDER, Octave};
use crate::error::FitError;
use crate::estimate::Estimate;
use crate::histories::{Histories, Surface};
use crate::linear::solve;
use crate::measurements::Measurements;
use crate::octaves::{self, FITTED_HZ, JND, measures, octaves_at};
use crate::picture::Curve;
use crate::residual::Residual;
use crate::walls::{Path, WALLS, Walls};
use promenade_acoustics::Air;
use rayon::prelude::*;

/// Unknowns of an octave: a logit for each wall, scattering's, and the logarithm of the sharpness.
const UNKNOWNS: usize = 8;
/// Steps at most.
const STEPS: usize = 12;
/// What is assumed of scattering: logit of 0.2, and its standard deviation.
const SCATTERING: (f64, f64) = (-1.4, 1.0);
/// What is assumed of the sharpness of a source that faces somewhere, by octave: that of a small loudspeaker, and the standard
/// deviation of its logarithm.
const SHARPNESS: ([f64; 8], f64) = ([0.03, 0.05, 0.1, 0.25, 0.5, 0.8, 1.2, 1.6], 0.8);
/// Standard deviation of the mean logit of all walls: nothing is known.
const ANY: f64 = 3.0;
/// A logit that is known less than this much better than before is not determined by the data: share of the prior's standard
/// deviation.
const UNDETERMINED: f64 = 0.7;
/// No figure counts for more differences than this.
const MOST_JND: f64 = 20.0;
/// The least and greatest energy of images that the early residual makes of theirs.
const EARLY: (f64, f64) = (0.1, 4.0);

/// The fit of one octave.
#[derive(Clone, Debug, PartialEq)]
pub struct OctaveFit {
    /// Of each wall.
    pub absorption: [Estimate; 6],
    /// Of all walls alike.
    pub scattering: Estimate,
    /// Of the source.
    pub sharpness: Estimate,
    /// The source's energy on its axis at 1 m, dB.
    pub level_db: f64,
    /// Energy of the measured late part over that of the model, between 80 and 250 ms, dB, and measured T20 over the model's:
    /// what surfaces do not explain.
    pub residual_db: f64,
    /// See [`OctaveFit::residual_db`].
    pub residual_decay: f64,
    /// Energy of reflections up to 80 ms over that of the model's images, dB.
    pub residual_early_db: f64,
    /// Root mean square of what is left in T20, EDT, C80 and level, just noticeable differences.
    pub left_jnd: f64,
    /// Whether the responses decay far enough to be fitted at all.
    pub fitted: bool,
}

impl OctaveFit {
    /// As a model, in some air.
    #[must_use]
    pub fn octave(&self, number: usize, air: &Air) -> Octave {
        let surface = |a: &Estimate| Surface { absorption: a.value, scattering: self.scattering.value };
        Octave {
            surfaces: self.absorption.each_ref().map(surface),
            sharpness: self.sharpness.value,
            air_per_m: air.energy_decay_per_m(FITTED_HZ[number]),
            speed_m_s: air.speed_m_s(),
        }
    }
}

/// The quick fit of a box.
#[derive(Clone, Debug)]
pub struct QuickFit {
    /// The room.
    pub walls: Walls,
    /// By octave, [`FITTED_HZ`].
    pub octaves: Vec<OctaveFit>,
    /// Whether sources face somewhere.
    pub facing: bool,
    /// The trace that it was made with.
    pub histories: Histories,
    /// What surfaces do not explain.
    pub residual: Residual,
}

impl QuickFit {
    /// The same room with another absorption of a wall, by octave from 125 Hz.
    #[must_use]
    pub fn with_absorption(&self, wall: usize, absorption: &promenade_acoustics::Octaves) -> Self {
        let mut changed = self.clone();
        for (number, octave) in changed.octaves.iter_mut().enumerate() {
            let value = f64::from(absorption[number.saturating_sub(1)]);
            octave.absorption[wall] = Estimate { value, error: 0.0, determined: true };
        }
        changed
    }

    /// Absorption by wall in the octaves from 125 Hz.
    #[must_use]
    pub fn curves(&self) -> Vec<Curve> {
        let points = |w: usize| self.octaves.iter().zip(FITTED_HZ).skip(1).map(|(o, hz)| (hz, o.absorption[w])).collect();
        WALLS.iter().enumerate().map(|(w, name)| Curve { name: (*name).to_owned(), points: points(w) }).collect()
    }

    /// Octaves that could not be fitted, hertz.
    #[must_use]
    pub fn missing_hz(&self) -> Vec<f64> {
        self.octaves.iter().zip(FITTED_HZ).filter(|(o, _)| !o.fitted).map(|(_, hz)| hz).collect()
    }

    /// What the model says of the reverberation time of an octave, with its residual, seconds; NaN where it has none.
    #[must_use]
    pub fn t20_s(&self, octave: usize) -> f64 {
        let model = self.octaves[octave].octave(octave, &self.histories.air);
        let [_, whole] = self.histories.energies(&model.surfaces, ORDER, model.air_per_m);
        measures(&whole, BIN_S)[0] * self.octaves[octave].residual_decay
    }
}

/// What one place tells of one octave.
struct Heard {
    measured: [f64; 4],
    /// Between 80 and 250 ms.
    late: f64,
}

/// A measurement's paths and facing.
struct Seen {
    paths: Vec<Path>,
    facing: Option<[f64; 3]>,
}

/// The fit without its residual.
fn of_surfaces(walls: &Walls, set: &Measurements, seed: u64) -> Result<QuickFit, FitError> {
    walls.check()?;
    let rate = f64::from(set.sample_rate_hz);
    for one in &set.all {
        for (what, at) in [("source", one.source.at_m), ("microphone", one.microphone.at_m)] {
            if !walls.holds(at, 0.0) {
                let [low, high] = [walls.low_m, walls.high_m];
                let expected = format!("its {what} in the room from {low:?} to {high:?} m");
                return Err(crate::error::measurement(&one.name, expected, format!("{at:?}")));
            }
        }
    }
    let Some(first) = set.all.first() else {
        return Err(FitError::argument("measurements", "at least one", "none"));
    };
    let length_s = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0) as f64 / rate;
    let histories = Histories::of_box(walls, set.air, first.source.at_m, BIN_S, length_s.clamp(0.2, 4.0), seed);
    let facing = set.all.iter().all(|m| m.source.facing.is_some());
    let reach = length_s * set.air.speed_m_s();
    let seen: Vec<Seen> = set
        .all
        .par_iter()
        .map(|m| Seen {
            paths: walls.paths(m.source.at_m, m.microphone.at_m, ORDER, reach),
            facing: m.source.facing.filter(|_| facing),
        })
        .collect();
    // By place, then by octave.
    let heard: Vec<Vec<Heard>> = set
        .all
        .par_iter()
        .map(|m| {
            let of = |(bins, measured): (Vec<f64>, _)| Heard { measured, late: late(&bins) };
            octaves::heard(&m.samples, rate, BIN_S).into_iter().map(of).collect()
        })
        .collect();
    let octaves = (0..octaves_at(rate))
        .into_par_iter()
        .map(|octave| {
            let heard: Vec<&Heard> = heard.iter().map(|h| &h[octave]).collect();
            Octaves { histories: &histories, seen: &seen, heard, number: octave, facing }.fit()
        })
        .collect();
    Ok(QuickFit { walls: *walls, octaves, facing, histories, residual: Residual::default() })
}

/// Energy between 80 and 250 ms.
fn late(bins: &[f64]) -> f64 {
    let at = |s: f64| ((s / BIN_S).round() as usize).min(bins.len());
    bins[at(0.08)..at(0.25)].iter().sum()
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// One octave while it is fitted.
struct Octaves<'a> {
    histories: &'a Histories,
    seen: &'a [Seen],
    heard: Vec<&'a Heard>,
    number: usize,
    facing: bool,
}

impl Octaves<'_> {
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
        self.seen.iter().map(|seen| model.at(&seen.paths, seen.facing, &diffuse)).collect()
    }

    /// What is left of each measure, in differences, and the level of the source in dB.
    fn residuals(&self, x: &[f64; UNKNOWNS]) -> (Vec<f64>, f64) {
        let found: Vec<[f64; 4]> = self.energies(x).iter().map(|e| measures(e, BIN_S)).collect();
        let gaps: Vec<f64> =
            found.iter().zip(&self.heard).map(|(f, h)| h.measured[3] - f[3]).filter(|g| g.is_finite()).collect();
        let level = gaps.iter().sum::<f64>() / gaps.len().max(1) as f64;
        let mut all = Vec::with_capacity(4 * found.len() + UNKNOWNS);
        for (f, h) in found.iter().zip(&self.heard) {
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
        all.push((x[7] - SHARPNESS.0[self.number].ln()) / SHARPNESS.1);
        (all, level)
    }

    fn start(&self) -> [f64; UNKNOWNS] {
        let mut x = [-1.5; UNKNOWNS];
        x[6] = SCATTERING.0;
        x[7] = SHARPNESS.0[self.number].ln();
        x
    }

    fn fit(&self) -> OctaveFit {
        let fitted = self.heard.iter().any(|h| h.measured[0].is_finite());
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
        let observed = 4 * self.seen.len();
        let left_jnd = (r[..observed].iter().map(|v| v * v).sum::<f64>() / observed as f64).sqrt();
        let (matrix, _) = self.normal(x, r);
        let variances = solve(&matrix, &[0.0; UNKNOWNS]).map_or([f64::INFINITY; UNKNOWNS].to_vec(), |(_, v)| v);
        // Places of one room are alike, so that what is left counts for all of them together.
        let scale = left_jnd.max(1.0);
        let sd = |i: usize| scale * variances[i].sqrt();
        let share = |i: usize, prior: f64| {
            let value = logistic(x[i]);
            Estimate { value, error: sd(i) * value * (1.0 - value), determined: fitted && sd(i) < UNDETERMINED * prior }
        };
        let prior = std::f64::consts::LN_2;
        let model = self.energies(x);
        let (mut late_db, mut decay, mut count) = (0.0, 0.0, 0.0);
        for (energies, heard) in model.iter().zip(&self.heard) {
            let gap = 10.0 * (heard.late / late(energies)).log10() - level_db;
            let ratio = heard.measured[0] / measures(energies, BIN_S)[0];
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
                determined: self.facing && fitted && sd(7) < UNDETERMINED * SHARPNESS.1,
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
        let (mut missing, mut images) = (0.0, 0.0);
        for (seen, heard) in self.seen.iter().zip(&self.heard) {
            let [_, _, c80, whole_db] = heard.measured;
            let measured = 10f64.powf(whole_db / 10.0) / (1.0 + 10f64.powf(-c80 / 10.0)) / level;
            let (direct, all) = seen.paths.split_at(1.min(seen.paths.len()));
            let direct: f64 = direct.iter().map(|p| model.energy(p, seen.facing)).sum();
            let rest = early(&model.at(&seen.paths[..1.min(seen.paths.len())], seen.facing, &diffuse)) - direct;
            let end = seen.paths.first().map_or(0.0, |p| p.length_m) + 0.08 * model.speed_m_s;
            let own: f64 = all.iter().filter(|p| p.length_m < end).map(|p| model.energy(p, seen.facing)).sum();
            if measured.is_finite() {
                // Places count alike, however near the source is.
                missing += (measured - direct - gain * rest) / measured;
                images += own / measured;
            }
        }
        10.0 * (missing / images).clamp(EARLY.0, EARLY.1).log10()
    }
}
