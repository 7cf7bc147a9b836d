//! Tiles of outputs that are summed in registers.

use super::panel::{PANEL, Row};
use pulp::Simd;

/// Work on `V` neighbouring vectors of a panel's positions, with tiles of `M` outputs by `V` vectors in registers.
pub(crate) trait Columns {
    /// Works on the vectors from number `first` on.
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize);
}

/// Covers the vectors that hold `positions` positions by tiles that the registers have room for.
#[inline(always)]
pub(crate) fn in_columns<S: Simd>(simd: S, positions: usize, work: &mut impl Columns) {
    let vectors = positions.min(PANEL).div_ceil(S::F32_LANES);
    for first in (0..vectors).step_by(2) {
        // Enough sums that none waits for its last product, no more than there are registers, of which browsers have 16.
        match (first + 1 < vectors, S::REGISTER_COUNT >= 32 && !cfg!(target_family = "wasm")) {
            (true, true) => work.columns::<S, 8, 2>(simd, first),
            (true, false) => work.columns::<S, 4, 2>(simd, first),
            (false, _) => work.columns::<S, 8, 1>(simd, first),
        }
    }
}

/// Adds the outer products of `M` numbers and `V` vectors, term by term.
#[inline(always)]
pub(super) fn add_products<'a, S: Simd, const M: usize, const V: usize>(
    simd: S,
    first: usize,
    mut sums: [[S::f32s; V]; M],
    terms: impl Iterator<Item = ([&'a f32; M], &'a Row)>,
) -> [[S::f32s; V]; M] {
    for (numbers, row) in terms {
        let x = row.load::<S, V>(simd, first);
        for m in 0..M {
            let number = simd.splat_f32s(*numbers[m]);
            for v in 0..V {
                sums[m][v] = simd.mul_add_e_f32s(number, x[v], sums[m][v]);
            }
        }
    }
    sums
}

/// References to `M` of eight numbers, from `M * part` on.
#[inline(always)]
pub(super) fn part_of<const M: usize>(eight: &[f32; 8], part: usize) -> [&f32; M] {
    let part = part.min(8 / M - 1);
    let mut some = [&eight[0]; M];
    for m in 0..M {
        some[m] = &eight[part * M + m];
    }
    some
}
