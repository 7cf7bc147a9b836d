//! Linear layers on a panel.

mod single;

use super::panel::Row;
use super::tile::{Columns, add_products, in_columns, part_of};
use crate::simd::{TILE, Weights, all, larger, plus, smaller, times_plus};
use pulp::{Arch, Simd, WithSimd};

/// What a product is added to, besides the bias.
#[derive(Clone, Copy)]
pub(crate) enum Start<'a> {
    /// Nothing.
    Bias,
    /// What the output holds.
    Output,
    /// Rows like the output's.
    Rows(&'a [Row]),
}

/// What a product's outputs go through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Activation {
    None,
    Relu,
    /// With this slope below 0.
    Prelu(f32),
}

/// `output = activation(start + bias + weights * input)` at the first `positions` positions of a panel.
pub(crate) struct PanelProduct<'a> {
    pub(crate) weights: &'a Weights,
    pub(crate) input: &'a [Row],
    pub(crate) start: Start<'a>,
    pub(crate) activation: Activation,
    pub(crate) positions: usize,
    pub(crate) output: &'a mut [Row],
}

impl PanelProduct<'_> {
    pub(crate) fn run(self, arch: Arch) {
        // The outputs of a tile fill no wider vector.
        #[cfg(target_arch = "x86_64")]
        let arch = match arch {
            Arch::V4(v4) if self.positions == 1 => Arch::V3(*v4),
            other => other,
        };
        arch.dispatch(self);
    }
}

impl WithSimd for PanelProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        match (self.positions, S::F32_LANES) {
            (1, 8) => single::product::<S, 1>(simd, &mut self),
            (1, 4) => single::product::<S, 2>(simd, &mut self),
            _ => in_columns(simd, self.positions, &mut self),
        }
    }
}

impl Columns for PanelProduct<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let inputs = self.weights.inputs();
        let input = &self.input[..inputs];
        for (t, (weights, bias)) in self.weights.packed().chunks_exact(inputs).zip(self.weights.bias()).enumerate() {
            let output = &mut self.output[t * TILE..][..TILE];
            for part in 0..TILE / M {
                let bias = part_of::<M>(bias, part);
                let mut sums = [all(simd, 0.0); M];
                for m in 0..M {
                    let row = part * M + m;
                    let start = match self.start {
                        Start::Bias => all(simd, 0.0),
                        Start::Output => output[row].load::<S, V>(simd, first),
                        Start::Rows(rows) => rows[t * TILE + row].load::<S, V>(simd, first),
                    };
                    sums[m] = plus(simd, start, all(simd, *bias[m]));
                }
                let terms = weights.iter().map(|w| part_of::<M>(w, part)).zip(input);
                let sums = add_products::<S, M, V>(simd, first, sums, terms);
                for m in 0..M {
                    let above = larger(simd, sums[m], all(simd, 0.0));
                    let active = match self.activation {
                        Activation::None => sums[m],
                        Activation::Relu => above,
                        Activation::Prelu(slope) => {
                            let below = smaller(simd, sums[m], all(simd, 0.0));
                            times_plus(simd, all(simd, slope), below, above)
                        }
                    };
                    output[part * M + m].store::<S, V>(simd, first, active);
                }
            }
        }
    }
}
