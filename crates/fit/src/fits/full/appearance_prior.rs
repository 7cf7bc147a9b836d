//! What patches absorb by their appearance, learnt from those that sound tells of.

use crate::appearance::{Example, Regressor};
use crate::bands::{BANDS, PerBand};
use crate::room::Patch;

/// Side of a place that is left out as one when predictions are learnt, metres.
const PART_M: f64 = 1.2;
/// Predictions are learnt where a number is known so much better than before: what is known less well is near to what was known
/// before, and would teach that.
const CLEAR: f64 = 0.55;
/// Least standard deviation of what is learnt from, of logits.
const LEARNT: f64 = 0.3;

/// What is known before of patches that pictures show.
pub(super) struct AppearancePrior<'a> {
    pub(super) regressor: Regressor,
    pub(super) features: &'a [Option<Vec<f64>>],
    /// What the whole surface of each patch absorbs.
    pub(super) whole: Vec<PerBand>,
    /// What the regressor counts beside that, by band.
    pub(super) shares: PerBand,
}

impl AppearancePrior<'_> {
    /// Means of patches.
    pub(super) fn means(&self) -> Vec<PerBand> {
        let one = |(own, whole): (&Option<Vec<f64>>, &PerBand)| match own {
            Some(own) => {
                let (found, _) = self.regressor.of(own);
                std::array::from_fn(|b| self.shares[b] * found[b] + (1.0 - self.shares[b]) * whole[b])
            }
            None => *whole,
        };
        self.features.iter().zip(&self.whole).map(one).collect()
    }

    /// Moves the regressor against derivatives by all numbers.
    pub(super) fn step(&mut self, by: &[f64], weight: f64, rate: f64) {
        let one = |(p, own): (usize, &'_ Option<Vec<f64>>)| -> Option<(usize, PerBand)> {
            own.as_ref().map(|_| (p, std::array::from_fn(|b| self.shares[b] * by[p * BANDS + b])))
        };
        let by: Vec<(usize, PerBand)> = self.features.iter().enumerate().filter_map(one).collect();
        let by: Vec<(&[f64], PerBand)> = by.iter().filter_map(|(p, by)| Some((self.features[*p].as_deref()?, *by))).collect();
        self.regressor.step(&by, weight, rate);
    }
}

/// The place of a patch that is left out as one.
pub(super) fn part(patch: &Patch) -> u64 {
    let cell = |a: usize| ((patch.centre_m[a] / PART_M).floor() as i64).cast_unsigned() & 0xFFFF;
    (patch.wall as u64) << 48 | cell(0) << 32 | cell(1) << 16 | cell(2)
}

/// Learns from the features of patches that sound tells of: logits `x` with their standard errors.
pub(super) fn learn(
    (patches, features): (&[Patch], &[Option<Vec<f64>>]),
    x: &[f64],
    errors: &[[(f64, bool); BANDS]],
    table: &PerBand,
    seed: u64,
) -> Option<Regressor> {
    let example = |(p, own): (usize, &'_ Option<Vec<f64>>)| {
        own.as_ref()?;
        let weight: PerBand = std::array::from_fn(|b| {
            let (error, _) = errors[p][b];
            if error < CLEAR * table[b] { table[b].powi(2) / (error.powi(2) + LEARNT.powi(2)) } else { 0.0 }
        });
        let some = weight.iter().any(|w| *w > 0.0);
        some.then_some((p, weight))
    };
    let clear: Vec<(usize, PerBand)> = features.iter().enumerate().filter_map(example).collect();
    let examples = clear.iter().filter_map(|(p, weight)| {
        let value = std::array::from_fn(|b| x[p * BANDS + b]);
        Some(Example { features: features[*p].as_deref()?, value, weight: *weight, part: part(&patches[*p]) })
    });
    Regressor::learn(&examples.collect::<Vec<_>>(), seed)
}
