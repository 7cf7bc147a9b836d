//! Powers of two.

use crate::simd::{all, larger, minus, plus, times_plus};
use pulp::Simd;

/// The least exponent; smaller ones count as this.
const LEAST: f32 = -100.0;
/// Adding and taking away 1.5 * 2^23 rounds to a whole number, which is left in the low bits.
const ROUND: f32 = 12_582_912.0;
/// `2^f = 1 + f * (c0 + f * (c1 + ...))` for f in [-0.5, 0.5], minimax in relative error.
const SERIES: [f32; 5] = [std::f32::consts::LN_2, 0.240_222_83, 0.055_505_585, 0.009_669_691, 0.001_330_060_7];

/// `2^x` for x up to 0, within 3e-7 relative; 2^-100 below that.
#[inline(always)]
pub(super) fn exp2<S: Simd, const V: usize>(simd: S, x: [S::f32s; V]) -> [S::f32s; V] {
    let round = all(simd, ROUND);
    let x = larger(simd, x, all(simd, LEAST));
    let shifted = plus(simd, x, round);
    let fraction = minus(simd, x, minus(simd, shifted, round));
    let mut series = all(simd, SERIES[4]);
    for c in [SERIES[3], SERIES[2], SERIES[1], SERIES[0], 1.0] {
        series = times_plus(simd, series, fraction, all(simd, c));
    }
    for v in 0..V {
        let exponent = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted[v]), simd.splat_u32s(23));
        series[v] = simd.transmute_f32s_u32s(simd.add_u32s(simd.transmute_u32s_f32s(series[v]), exponent));
    }
    series
}
