//! Sums over taps, block by block, that the render head spends its time on.

use crate::render::transform::ring::Slot;
use crate::simd::{all, load, times_plus};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

pub(crate) use crate::render::transform::block::{Block, EarBlocks, blocks_for, ear_spectrum};
pub(crate) use crate::simd::LANES;

/// Adds `filter[block][taps.start + i]` times a frame of which `i` is the age to both ears, over `i`, block by block.
pub(crate) struct Accumulate<'a, const EARS: usize> {
    pub(crate) arch: Arch,
    /// The frame of the first tap, one for both ears or for each; the others have those before it.
    pub(crate) newest: [Slot<'a>; EARS],
    /// Filters `[block][hop]`, and the hops that are applied.
    pub(crate) filter: &'a [EarBlocks],
    pub(crate) hops: usize,
    pub(crate) taps: Range<usize>,
    pub(crate) sums: &'a mut [EarBlocks],
}

impl<const EARS: usize> Accumulate<'_, EARS> {
    pub(crate) fn run(self) {
        self.arch.dispatch(self);
    }
}

impl<const EARS: usize> WithSimd for Accumulate<'_, EARS> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { newest, filter, hops, taps: range, sums, .. } = self;
        if range.is_empty() {
            return;
        }
        let histories = newest[0].histories().zip(newest[EARS - 1].histories());
        for ((sum, (left, right)), taps) in sums.iter_mut().zip(histories).zip(filter.chunks_exact(hops)) {
            let (taps, older_taps) = taps[range.clone()].split_at(left[0].len().min(range.len()));
            for v in 0..LANES / S::F32_LANES {
                // Products with the input's real and its imaginary part have sums of their own: four chains of additions would
                // wait for each other, eight do not.
                let zero = simd.splat_f32s(0.0);
                let (mut by_re, mut by_im) = ([zero; 4], [zero; 4]);
                for (i, taps) in [taps, older_taps].into_iter().enumerate() {
                    // One frame for both ears is read once.
                    for ((x, right), h) in left[i].iter().zip(right[i]).zip(taps) {
                        let (x, h) = ([x, if EARS == 1 { x } else { right }], h.parts::<S>(v));
                        for i in 0..4 {
                            let (re, im) = (part::<S>(&x[i / 2].re, v), part::<S>(&x[i / 2].im, v));
                            by_re[i] = simd.mul_add_e_f32s(h[i], re, by_re[i]);
                            by_im[i] = simd.mul_add_e_f32s(h[i], im, by_im[i]);
                        }
                    }
                }
                let before = sum.parts::<S>(v);
                for ear in 0..2 {
                    let (re, im) = (2 * ear, 2 * ear + 1);
                    let sum = &mut sum.ears[ear];
                    put::<S>(&mut sum.re, v, simd.add_f32s(before[re], simd.sub_f32s(by_re[re], by_im[im])));
                    put::<S>(&mut sum.im, v, simd.add_f32s(before[im], simd.add_f32s(by_re[im], by_im[re])));
                }
            }
        }
    }
}

/// One vector of a row of numbers of a block.
#[inline(always)]
pub(crate) fn part<S: Simd>(row: &[f32; LANES], vector: usize) -> S::f32s {
    S::as_simd_f32s(row).0[vector]
}

/// Sets one vector of a row of numbers of a block.
#[inline(always)]
pub(crate) fn put<S: Simd>(row: &mut [f32; LANES], vector: usize, value: S::f32s) {
    S::as_mut_simd_f32s(row).0[vector] = value;
}

impl EarBlocks {
    /// One vector of each row: real and imaginary parts of the left ear, then of the right.
    #[inline(always)]
    pub(crate) fn parts<S: Simd>(&self, vector: usize) -> [S::f32s; 4] {
        let [left, right] = &self.ears;
        [part::<S>(&left.re, vector), part::<S>(&left.im, vector), part::<S>(&right.re, vector), part::<S>(&right.im, vector)]
    }

    /// Sets one vector of each row, in the same order.
    #[inline(always)]
    pub(crate) fn put_parts<S: Simd>(&mut self, vector: usize, parts: [S::f32s; 4]) {
        let [left, right] = &mut self.ears;
        put::<S>(&mut left.re, vector, parts[0]);
        put::<S>(&mut left.im, vector, parts[1]);
        put::<S>(&mut right.re, vector, parts[2]);
        put::<S>(&mut right.im, vector, parts[3]);
    }
}

/// Weighted sum of rows: `out = sum_c weight_c * rows[c]`.
pub(crate) struct WeightedSum<'a> {
    pub(crate) rows: &'a [f32],
    /// Number of each row and its weight.
    pub(crate) corners: &'a [(u32, f32)],
    pub(crate) row_len: usize,
    /// Offset of the part that is summed within each row.
    pub(crate) offset: usize,
    pub(crate) out: &'a mut [f32],
}

impl WeightedSum<'_> {
    /// Sums some vectors from a place of the rows on, in registers.
    #[inline(always)]
    fn vectors<S: Simd, const V: usize>(&mut self, simd: S, at: usize) {
        let len = V * S::F32_LANES;
        let mut sums = all::<S, V>(simd, 0.0);
        for &(corner, weight) in self.corners {
            let start = corner as usize * self.row_len + self.offset + at;
            let row = load::<S, V>(simd, &self.rows[start..start + len]);
            sums = times_plus(simd, all(simd, weight), row, sums);
        }
        let out = S::as_mut_simd_f32s(&mut self.out[at..at + len]).0;
        out[..V].copy_from_slice(&sums);
    }
}

impl WithSimd for WeightedSum<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (len, lanes) = (self.out.len(), S::F32_LANES);
        let mut at = 0;
        while at + 4 * lanes <= len {
            self.vectors::<S, 4>(simd, at);
            at += 4 * lanes;
        }
        while at + lanes <= len {
            self.vectors::<S, 1>(simd, at);
            at += lanes;
        }
        for i in at..len {
            let value = |&(corner, weight): &(u32, f32)| weight * self.rows[corner as usize * self.row_len + self.offset + i];
            self.out[i] = self.corners.iter().map(value).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::transform::ring::Ring;
    use promenade_fourier::num_complex::Complex32;

    #[test]
    fn sums_over_taps_equal_the_plain_complex_sum() {
        let (bins, taps) = (37, 5);
        let blocks = blocks_for(bins);
        let value = |k: usize, t: usize| Complex32::new((k * 3 + t) as f32 % 7.0 - 3.0, (k + 2 * t) as f32 % 5.0 - 2.0);
        let mut ring = Ring::new(blocks, taps + 1);
        for t in (0..taps + 3).rev() {
            ring.write(&(0..bins).map(|k| value(k, t)).collect::<Vec<_>>());
        }
        let mut filter = vec![EarBlocks::default(); blocks * taps];
        for k in 0..bins {
            for t in 0..taps {
                let f = &mut filter[k / LANES * taps + t];
                for (ear, b) in f.ears.iter_mut().enumerate() {
                    let h = value(k + ear, t + 1);
                    b.re[k % LANES] = h.re;
                    b.im[k % LANES] = h.im;
                }
            }
        }
        let mut sums = vec![EarBlocks::default(); blocks];
        for taps in [0..2, 2..5] {
            let (newest, sums) = ([ring.at(taps.start + 1)], &mut sums);
            Accumulate { arch: Arch::new(), newest, filter: &filter, hops: 5, taps, sums }.run();
        }
        for k in 0..bins {
            for ear in 0..2 {
                let want: Complex32 = (0..taps).map(|t| value(k + ear, t + 1) * value(k, t + 1)).sum();
                let got = sums[k / LANES].ears[ear];
                assert!((got.re[k % LANES] - want.re).abs() < 1e-4 && (got.im[k % LANES] - want.im).abs() < 1e-4);
            }
        }
    }
}
