//! Tiles of sums that fit the registers: some outputs by some vectors of positions.

use super::vectors::load;
use pulp::Simd;

/// Work on some outputs by some vectors of positions, all of whose sums fit the registers.
pub(crate) trait Tile {
    /// Works on `O` outputs and `V` vectors.
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize);
}

/// Covers all outputs, a multiple of [`TILE`](super::TILE) or a little less, and positions.
#[inline(always)]
pub(crate) fn for_tiles<S: Simd>(simd: S, outputs: usize, positions: usize, op: &mut impl Tile) {
    let vectors = positions.div_ceil(S::F32_LANES);
    // Three vectors of sums for each output, three of input and a weight: 28 of 32 registers, or all of 16.
    let threes = vectors / 3;
    for three in 0..threes {
        let position = 3 * three * S::F32_LANES;
        if S::REGISTER_COUNT >= 32 {
            for output in (0..outputs).step_by(8) {
                op.tile::<S, 8, 3>(simd, output, position);
            }
        } else {
            for output in (0..outputs).step_by(4) {
                op.tile::<S, 4, 3>(simd, output, position);
            }
        }
    }
    let position = 3 * threes * S::F32_LANES;
    for output in (0..outputs).step_by(4) {
        match vectors % 3 {
            2 => op.tile::<S, 4, 2>(simd, output, position),
            1 => op.tile::<S, 4, 1>(simd, output, position),
            _ => {}
        }
    }
}

/// Covers all positions of `O` outputs that are too few for [`for_tiles`].
#[inline(always)]
pub(crate) fn for_few<S: Simd, const O: usize>(simd: S, positions: usize, op: &mut impl Tile) {
    let vectors = positions.div_ceil(S::F32_LANES);
    let sixes = vectors / 6;
    for six in 0..sixes {
        op.tile::<S, O, 6>(simd, 0, 6 * six * S::F32_LANES);
    }
    let position = 6 * sixes * S::F32_LANES;
    match vectors % 6 {
        5 => op.tile::<S, O, 5>(simd, 0, position),
        4 => op.tile::<S, O, 4>(simd, 0, position),
        3 => op.tile::<S, O, 3>(simd, 0, position),
        2 => op.tile::<S, O, 2>(simd, 0, position),
        1 => op.tile::<S, O, 1>(simd, 0, position),
        _ => {}
    }
}

/// Adds weights times one stretch of a row to the sums of a tile.
#[inline(always)]
pub(crate) fn step<S: Simd, const O: usize, const V: usize>(simd: S, acc: &mut [[S::f32s; V]; O], weights: &[f32], x: &[f32]) {
    let x = load::<S, V>(simd, x);
    for (acc, w) in acc.iter_mut().zip(weights) {
        let w = simd.splat_f32s(*w);
        for (a, x) in acc.iter_mut().zip(&x) {
            *a = simd.mul_add_e_f32s(w, *x, *a);
        }
    }
}
