//! What patches of surfaces absorb.

use crate::bands::{BANDS, Estimate, PerBand, logistic, logit};
use crate::room::Voxels;
use std::sync::Arc;

/// What pieces of surfaces absorb.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelFit {
    /// The pieces.
    pub voxels: Arc<Voxels>,
    /// Absorption of each by band.
    pub absorption: Vec<[Estimate; BANDS]>,
    /// Whether a piece was guessed from pictures, since no sound that was heard tells of it.
    pub guessed: Vec<bool>,
    /// How far guesses from pictures are off where sound tells what is right, by band, as a share of absorption at the mean;
    /// none without pictures or where these predict nothing.
    pub off: Option<PerBand>,
    /// Pieces that pictures show.
    pub shown: usize,
    /// Mean difference of logarithms that is left.
    pub left: f64,
}

impl VoxelFit {
    /// Whether sound that was heard tells of a piece: in half of the bands or more.
    #[must_use]
    pub fn is_touched(&self, patch: usize) -> bool {
        2 * self.absorption[patch].iter().filter(|e| e.determined).count() >= BANDS
    }

    /// Absorption of a surface: the mean over the area of its pieces.
    #[must_use]
    pub fn surface(&self, surface: usize) -> [Estimate; BANDS] {
        let own: Vec<usize> = (0..self.voxels.patches.len()).filter(|p| self.voxels.patches[*p].surface == surface).collect();
        let area: f64 = own.iter().map(|p| self.voxels.patches[*p].area_m2).sum();
        std::array::from_fn(|b| {
            let mean = |of: &dyn Fn(&Estimate) -> f64| -> f64 {
                own.iter().map(|p| self.voxels.patches[*p].area_m2 / area * of(&self.absorption[*p][b])).sum()
            };
            let determined = mean(&|e| f64::from(u8::from(e.determined))) > 0.5;
            Estimate { value: mean(&|e| e.value), error: mean(&|e| e.error), determined }
        })
    }
}

/// Materials of a surface at most, as it is written.
const MATERIALS: usize = 8;
/// Rounds in which pieces find the material that is nearest.
const SORTED: usize = 20;

impl VoxelFit {
    /// Sorts the pieces of each surface into at most eight materials that differ most (Lloyd 1982): of each piece the number
    /// within its surface, and of each surface the materials.
    pub(crate) fn materials(&self, surfaces: usize) -> (Vec<usize>, Vec<Vec<PerBand>>) {
        let value = |p: usize| -> PerBand { self.absorption[p].map(|e| logit(e.value)) };
        let far = |a: &PerBand, b: &PerBand| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let (mut of, mut all) = (vec![0; self.absorption.len()], vec![Vec::new(); surfaces]);
        for (s, found) in all.iter_mut().enumerate() {
            let own: Vec<usize> = (0..of.len()).filter(|p| self.voxels.patches[*p].surface == s).collect();
            let Some(first) = own.first() else { continue };
            // Begins with pieces that are as far from each other as can be.
            let mut middles = vec![value(*first)];
            while middles.len() < MATERIALS.min(own.len()) {
                let apart = |p: &usize| middles.iter().map(|m| far(m, &value(*p))).fold(f64::INFINITY, f64::min);
                let Some(next) = own.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))) else { break };
                let next = value(*next);
                middles.push(next);
            }
            for _ in 0..SORTED {
                for p in &own {
                    let to = |m: &usize| far(&middles[*m], &value(*p));
                    of[*p] = (0..middles.len()).min_by(|a, b| to(a).total_cmp(&to(b))).unwrap_or(0);
                }
                for (m, middle) in middles.iter_mut().enumerate() {
                    let area = |p: &&usize| self.voxels.patches[**p].area_m2;
                    let sum: f64 = own.iter().filter(|p| of[**p] == m).map(|p| area(&p)).sum();
                    if sum > 0.0 {
                        let mean = |b: usize| -> f64 {
                            own.iter().filter(|p| of[**p] == m).map(|p| area(&p) / sum * self.absorption[*p][b].value).sum()
                        };
                        *middle = std::array::from_fn(|b| logit(mean(b)));
                    }
                }
            }
            *found = middles.into_iter().map(|m| m.map(logistic)).collect();
        }
        (of, all)
    }
}
