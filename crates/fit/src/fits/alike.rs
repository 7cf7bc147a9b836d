//! Walls that were changed together: what they absorb before and after, by the reverberation of both.
//!
//! Loudspeakers that all face one microphone do not tell walls apart, but it is known which of them had their panels turned.
//! These are taken to be alike, before and after: absorption by octave that rays need for the reverberation times of the one
//! set, and of the other. What rays and measurements differ by before stays a factor. With part of the walls changed, or all of
//! them in part, times follow.

use super::full::FullFit;
use crate::bands::{FITTED_HZ, measures, octave_decays, octaves_at};
use crate::late::{BIN_S, Surface};
use crate::measurements::Measurements;
use rayon::prelude::*;

/// Rounds of bisection.
const ROUNDS: usize = 40;
/// Least and greatest absorption.
const RANGE: (f64, f64) = (1e-3, 0.999);

/// Surfaces that were changed, alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Alike {
    /// Numbers of the surfaces.
    pub surfaces: Vec<usize>,
    /// Their absorption before, by octave of [`FITTED_HZ`]; none where one of both reverberation times is unknown.
    pub before: Vec<Option<f64>>,
    /// After.
    pub after: Vec<Option<f64>>,
    /// Measured reverberation times over those of rays, before.
    factors: Vec<f64>,
}

/// Reverberation times by octave, seconds, the geometric mean over places; NaN where no response decays far enough.
#[must_use]
pub fn octave_t20_s(set: &Measurements) -> Vec<f64> {
    let rate = f64::from(set.sample_rate_hz);
    let all: Vec<Vec<f64>> = set
        .all
        .par_iter()
        .map(|m| octave_decays(&m.samples, rate, BIN_S).into_iter().map(|(_, measured)| measured[0].ln()).collect())
        .collect();
    let mean = |o: usize| {
        let known: Vec<f64> = all.iter().map(|one| one[o]).filter(|t| t.is_finite()).collect();
        if known.is_empty() { f64::NAN } else { (known.iter().sum::<f64>() / known.len() as f64).exp() }
    };
    (0..octaves_at(rate)).map(mean).collect()
}

impl Alike {
    /// Of a fit to the set before, and the set after.
    #[must_use]
    pub fn of(fit: &FullFit, surfaces: &[usize], before: &Measurements, after: &Measurements) -> Self {
        let (first, second) = (octave_t20_s(before), octave_t20_s(after));
        let mut alike =
            Self { surfaces: surfaces.to_vec(), before: Vec::new(), after: Vec::new(), factors: vec![1.0; first.len()] };
        for (o, (b, a)) in first.iter().zip(&second).enumerate() {
            let own = rays_t20_s(fit, o, &fit.octave(o));
            let known = [*b, *a, own].iter().all(|t| t.is_finite());
            alike.factors[o] = if known { b / own } else { 1.0 };
            let absorption = |t20_s: f64| known.then(|| alike.solve(fit, o, t20_s)).flatten();
            let (own, other) = (absorption(own), absorption(a / alike.factors[o]));
            alike.before.push(own);
            alike.after.push(other);
        }
        alike
    }

    /// The absorption of all of them that gives rays a reverberation time, if any does.
    fn solve(&self, fit: &FullFit, octave: usize, t20_s: f64) -> Option<f64> {
        let at = |a: f64| {
            let mut all = fit.octave(octave);
            self.surfaces.iter().for_each(|s| all[*s].absorption = a);
            rays_t20_s(fit, octave, &all)
        };
        let (mut low, mut high) = RANGE;
        if !(at(high)..=at(low)).contains(&t20_s) {
            return None;
        }
        for _ in 0..ROUNDS {
            let middle = 0.5 * (low + high);
            if at(middle) > t20_s { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    }

    /// Absorption in an octave of a surface of which a share is changed.
    fn mixed(&self, octave: usize, share: f64) -> Option<f64> {
        self.before[octave].zip(self.after[octave]).map(|(b, a)| b + share * (a - b))
    }

    /// Reverberation time of an octave with so much of each of the surfaces changed, 0 to 1, seconds; NaN where it is unknown.
    #[must_use]
    pub fn t20_s(&self, fit: &FullFit, octave: usize, shares: &[f64]) -> f64 {
        let mut all = fit.octave(octave);
        for (surface, share) in self.surfaces.iter().zip(shares) {
            let Some(absorption) = self.mixed(octave, *share) else { return f64::NAN };
            all[*surface].absorption = absorption;
        }
        self.factors[octave] * rays_t20_s(fit, octave, &all)
    }
}

fn rays_t20_s(fit: &FullFit, octave: usize, surfaces: &[Surface]) -> f64 {
    let air = fit.histories.air.energy_decay_per_m(FITTED_HZ[octave]);
    let [_, whole] = fit.histories.energies(surfaces, fit.order, air);
    measures(&whole, BIN_S)[0]
}
