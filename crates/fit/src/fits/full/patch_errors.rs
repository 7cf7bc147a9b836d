//! How sure it is what patches absorb.

use super::field::Field;
use super::fit::UNDETERMINED;
use super::patch_fit::PatchFitter;
use crate::bands::{BANDS, PerBand, logistic};
use crate::room::Path;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Patches about one that are asked how sure it is.
const LOCAL: usize = 60;

impl PatchFitter<'_> {
    /// Standard errors of logits by patch and band, and whether sound tells of them.
    ///
    /// What a path says of its patches together is taken apart as if those beside one were known no better than before; patches
    /// about one and the field between them then say how sure it is.
    pub(super) fn errors(&self, x: &[f64], field: &Field, sd: &[PerBand]) -> Vec<[(f64, bool); BANDS]> {
        let at = self.at(x);
        let left = self.left(self.mean_loss(&at));
        let all: Vec<Vec<(Path, PerBand)>> =
            (0..self.model.u.places).into_par_iter().map(|i| self.model.path_precisions(&at, i, left)).collect();
        let mut told = vec![[0.0; BANDS]; self.voxels.patches.len()];
        for (path, own) in all.iter().flatten() {
            for b in 0..BANDS {
                let grown = |(p, n): &(u16, f64)| {
                    let p = usize::from(*p);
                    (0.5 * n * logistic(x[p * BANDS + b])).powi(2) * sd[p][b].powi(2)
                };
                let sum: f64 = path.hits.iter().map(grown).sum();
                for hit in &path.hits {
                    let mine = grown(hit);
                    let p = usize::from(hit.0);
                    told[p][b] += mine / sd[p][b].powi(2) / (own[b].max(1e-12).recip() + sum - mine);
                }
            }
        }
        (0..told.len()).into_par_iter().map(|p| self.local(p, &told, field, sd)).collect()
    }

    fn local(&self, patch: usize, told: &[PerBand], field: &Field, sd: &[PerBand]) -> [(f64, bool); BANDS] {
        let mut near = self.voxels.around(patch, LOCAL);
        near.sort_unstable();
        let place = |p: u32| near.binary_search(&p).ok();
        let pairs: Vec<[usize; 2]> =
            self.voxels.neighbours.iter().filter_map(|[i, j]| Some([place(*i)?, place(*j)?])).collect();
        let own = place(patch as u32).unwrap_or(0);
        std::array::from_fn(|b| {
            let step = (field.rough * sd[patch][b]).powi(-2);
            let mut before = DMatrix::<f64>::zeros(near.len(), near.len());
            (0..near.len()).for_each(|k| before[(k, k)] = field.alone * step);
            for [i, j] in &pairs {
                before[(*i, *i)] += step;
                before[(*j, *j)] += step;
                before[(*i, *j)] -= step;
                before[(*j, *i)] -= step;
            }
            let mut after = before.clone();
            near.iter().enumerate().for_each(|(k, p)| after[(k, k)] += told[*p as usize][b]);
            let variance = |of: DMatrix<f64>| {
                let mut unit = DVector::<f64>::zeros(near.len());
                unit[own] = 1.0;
                of.cholesky().map_or(f64::INFINITY, |c| c.solve(&unit)[own])
            };
            let share = (variance(after) / variance(before)).sqrt();
            (sd[patch][b] * share, share < UNDETERMINED)
        })
    }
}
