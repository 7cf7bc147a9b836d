//! The hyper-network's hidden layers over the embedding of every band.

use crate::network::{CloudModel, Masks};
use crate::published::frames::{FrameProduct, Frames};
use crate::simd::Weights;
use pulp::Arch;

/// Embeddings of all bands, `[feature][band]`.
pub(super) struct Embedding {
    rows: Frames,
}

impl Embedding {
    pub(super) fn new(model: &CloudModel) -> Self {
        let sizes = model.sizes();
        Self { rows: Frames::new(sizes.width, sizes.bands) }
    }

    /// Takes the embedding of new masks.
    pub(super) fn set(&mut self, masks: &Masks) -> &Frames {
        let width = self.rows.count();
        debug_assert_eq!(masks.embedding.len(), width * self.rows.len());
        // Blocks of features: each line of the source is read once.
        for start in (0..width).step_by(8) {
            for feature in start..(start + 8).min(width) {
                let column = masks.embedding.iter().skip(feature).step_by(width);
                self.rows.row_mut(feature).iter_mut().zip(column).for_each(|(r, v)| *r = *v);
            }
        }
        &self.rows
    }
}

/// `ReLU(W embedding + b)`, `[unit][band]`.
pub(super) struct Hidden {
    weights: Weights,
    bias: Vec<f32>,
    rows: Frames,
}

impl Hidden {
    /// The first layer of `post_process.<name>`.
    pub(super) fn new(model: &CloudModel, name: &str) -> Self {
        let sizes = model.sizes();
        let w = model.weights(&format!("post_process.{name}.0.weight"));
        let bias = model.weights(&format!("post_process.{name}.0.bias")).to_vec();
        Self {
            weights: Weights::new(sizes.width, bias.len(), |input, unit| w[unit * sizes.width + input]),
            rows: Frames::new(bias.len(), sizes.bands),
            bias,
        }
    }

    pub(super) fn run(&mut self, arch: Arch, embedding: &Frames) -> &Frames {
        for (unit, bias) in self.bias.iter().enumerate() {
            self.rows.row_mut(unit).fill(*bias);
        }
        FrameProduct { weights: &self.weights, x: embedding, gate: None, out: &mut self.rows }.run(arch);
        for unit in 0..self.rows.count() {
            self.rows.row_mut(unit).iter_mut().for_each(|v| *v = v.max(0.0));
        }
        &self.rows
    }
}
