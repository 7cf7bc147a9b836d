//! Layer normalisation of a panel.

use super::panel::Row;
use super::tile::{Columns, in_columns};
use crate::simd::{all, minus, over, plus, root, times, times_plus};
use pulp::{Simd, WithSimd};

const EPSILON: f32 = 1e-5;

/// Normalises every position of a panel over its features, of which there are a multiple of 4, in place.
pub(crate) struct Norm<'a> {
    /// One per feature.
    pub(crate) scale: &'a [f32],
    pub(crate) bias: &'a [f32],
    pub(crate) positions: usize,
    pub(crate) rows: &'a mut [Row],
}

impl WithSimd for Norm<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        in_columns(simd, self.positions, &mut self);
    }
}

impl Columns for Norm<'_> {
    #[inline(always)]
    fn columns<S: Simd, const M: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let share = all(simd, 1.0 / self.rows.len() as f32);
        // Several sums, so that one addition need not wait for another.
        let mut sums = [all::<S, V>(simd, 0.0); 4];
        for four in self.rows.as_chunks::<4>().0 {
            for i in 0..4 {
                sums[i] = plus(simd, sums[i], four[i].load(simd, first));
            }
        }
        let mean = times(simd, total(simd, sums), share);
        let mut sums = [all::<S, V>(simd, 0.0); 4];
        for four in self.rows.as_chunks::<4>().0 {
            for i in 0..4 {
                let offset = minus(simd, four[i].load(simd, first), mean);
                sums[i] = times_plus(simd, offset, offset, sums[i]);
            }
        }
        let variance = times_plus(simd, total(simd, sums), share, all(simd, EPSILON));
        let inverse = over(simd, all(simd, 1.0), root(simd, variance));
        for ((row, scale), bias) in self.rows.iter_mut().zip(self.scale).zip(self.bias) {
            let unit = times(simd, minus(simd, row.load::<S, V>(simd, first), mean), inverse);
            row.store(simd, first, times_plus(simd, unit, all(simd, *scale), all(simd, *bias)));
        }
    }
}

/// `a + b + c + d`.
#[inline(always)]
pub(crate) fn total<S: Simd, const V: usize>(simd: S, sums: [[S::f32s; V]; 4]) -> [S::f32s; V] {
    plus(simd, plus(simd, sums[0], sums[1]), plus(simd, sums[2], sums[3]))
}
