//! A product with one position, the last of the `2^k + 1` bins of a transform: lanes run over outputs instead of positions.

use super::{Activation, PanelProduct, Start};
use crate::network::kernels::panel::Row;
use crate::simd::{TILE, all, times_plus};
use pulp::Simd;

/// Tiles of outputs that are summed side by side.
const SIDE_BY_SIDE: usize = 8;

/// `V` vectors hold the outputs of a tile.
#[inline(always)]
pub(super) fn product<S: Simd, const V: usize>(simd: S, product: &mut PanelProduct<'_>) {
    let inputs = product.weights.inputs();
    let input = &product.input[..inputs];
    let mut tile = 0;
    for group in product.weights.packed().chunks(SIDE_BY_SIDE * inputs) {
        if group.len() == SIDE_BY_SIDE * inputs {
            let sums = tiles::<S, V, SIDE_BY_SIDE>(simd, group, input);
            sums.iter().enumerate().for_each(|(t, sums)| finish(product, tile + t, sums));
        } else {
            for (t, weights) in group.chunks_exact(inputs).enumerate() {
                let [sums] = tiles::<S, V, 1>(simd, weights, input);
                finish(product, tile + t, &sums);
            }
        }
        tile += SIDE_BY_SIDE;
    }
}

/// Weighted sums of the inputs for `T` tiles of outputs.
#[inline(always)]
fn tiles<S: Simd, const V: usize, const T: usize>(simd: S, weights: &[[f32; TILE]], input: &[Row]) -> [[f32; TILE]; T] {
    let inputs = input.len();
    let mut tiles = [weights; T];
    for t in 0..T {
        tiles[t] = &weights[t * inputs..][..inputs];
    }
    let mut sums = [all::<S, V>(simd, 0.0); T];
    for i in 0..inputs {
        let x = all(simd, input[i].0[0]);
        for t in 0..T {
            let vectors = S::as_simd_f32s(&tiles[t][i]).0;
            let mut weights = x;
            weights.copy_from_slice(&vectors[..V]);
            sums[t] = times_plus(simd, weights, x, sums[t]);
        }
    }
    let mut out = [[0.0; TILE]; T];
    for t in 0..T {
        S::as_mut_simd_f32s(&mut out[t]).0.copy_from_slice(&sums[t]);
    }
    out
}

#[inline(always)]
fn finish(product: &mut PanelProduct<'_>, tile: usize, sums: &[f32; TILE]) {
    for (m, sum) in sums.iter().enumerate() {
        let output = tile * TILE + m;
        let start = match product.start {
            Start::Bias => 0.0,
            Start::Output => product.output[output].0[0],
            Start::Rows(rows) => rows[output].0[0],
        };
        let sum = start + product.weights.bias()[tile][m] + sum;
        product.output[output].0[0] = match product.activation {
            Activation::None => sum,
            Activation::Relu => sum.max(0.0),
            Activation::Prelu(slope) => sum.max(0.0) + slope * sum.min(0.0),
        };
    }
}
