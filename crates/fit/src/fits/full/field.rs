//! What is known of patches before sound is asked: a field that is smooth between neighbours and bands, with edges where it
//! must have them.

use crate::bands::{BANDS, PerBand};
use crate::room::Voxels;

/// Steps beyond so many standard deviations pull no harder: edges.
const EDGE: f64 = 1.5;

/// What is known of the pieces before sound is asked: means and standard deviations of logits.
pub(super) struct Field {
    pub(super) mean: Vec<PerBand>,
    pub(super) sd: Vec<PerBand>,
    /// Standard deviation of a step to the next band.
    pub(super) step: f64,
    /// Of a step between neighbours, over the field's.
    pub(super) rough: f64,
    /// Precision of a piece alone over that of a step.
    pub(super) alone: f64,
}

impl Field {
    /// Derivatives of half the sum of squares, times a weight.
    pub(super) fn add(&self, voxels: &Voxels, x: &[f64], weight: f64, by: &mut [f64]) {
        let off = |p: usize, b: usize| x[p * BANDS + b] - self.mean[p][b];
        for p in 0..voxels.patches.len() {
            for b in 0..BANDS {
                let step = self.rough * self.sd[p][b];
                by[p * BANDS + b] += weight * self.alone * off(p, b) / step.powi(2);
                if b > 0 {
                    let pull = weight * ((off(p, b) - off(p, b - 1)) / self.step).clamp(-EDGE, EDGE) / self.step;
                    // A piece alone has little to say of the field's form over frequency.
                    by[p * BANDS + b] += self.alone * pull;
                    by[p * BANDS + b - 1] -= self.alone * pull;
                }
            }
        }
        for pair in &voxels.neighbours {
            let [i, j] = pair.map(|p| p as usize);
            for b in 0..BANDS {
                let step = self.rough * (self.sd[i][b] * self.sd[j][b]).sqrt();
                let pull = weight * ((off(j, b) - off(i, b)) / step).clamp(-EDGE, EDGE) / step;
                by[j * BANDS + b] += pull;
                by[i * BANDS + b] -= pull;
            }
        }
    }
}
