//! Samples between samples: Lagrange's polynomial through six of them.

use crate::number::{single, whole};
use promenade_fourier::num_complex::Complex64;
use pulp::Simd;

/// Samples that the interpolation reaches before and after its place.
pub(crate) const BEFORE: usize = 2;
pub(crate) const AFTER: usize = 3;
pub(super) const POINTS: usize = BEFORE + 1 + AFTER;
/// Places between two samples that stand for all.
const PLACES: u8 = 16;

/// Lagrange's polynomial through six samples, `x[lane..lane + POINTS]` of each lane, at places from the third of them on, near
/// 0 to 1.
#[inline(always)]
pub(super) fn interpolate<S: Simd>(simd: S, x: &[f32], places: S::f32s) -> S::f32s {
    let (mul, splat) = (|a, b| simd.mul_f32s(a, b), |value| simd.splat_f32s(value));
    let x = |j: usize| S::as_simd_f32s(&x[j..j + S::F32_LANES]).0[0];
    let from = |node: f32| simd.sub_f32s(places, splat(node));
    let (a, b, c, d, e, f) = (from(-2.0), from(-1.0), places, from(1.0), from(2.0), from(3.0));
    let (ab, cd, ef) = (mul(a, b), mul(c, d), mul(e, f));
    let (abcd, def) = (mul(ab, cd), mul(d, ef));
    let outer = simd.sub_f32s(mul(mul(abcd, e), x(5)), mul(mul(mul(b, c), def), x(0)));
    let middle = simd.sub_f32s(mul(mul(mul(a, cd), ef), x(1)), mul(mul(abcd, f), x(4)));
    let inner = simd.sub_f32s(mul(mul(mul(ab, c), ef), x(3)), mul(mul(ab, def), x(2)));
    let sum = simd.mul_add_e_f32s(middle, splat(1.0 / 24.0), mul(inner, splat(1.0 / 12.0)));
    simd.mul_add_e_f32s(outer, splat(1.0 / 120.0), sum)
}

#[inline(always)]
pub(super) fn interpolate_one(x: &[f32], at: f64) -> f32 {
    let start = whole(at);
    let c = coefficients(single(at - start as f64));
    x[start - BEFORE..].iter().zip(c).map(|(x, c)| x * c).sum()
}

/// Weights of the samples at -2 to 3 for a place near 0 to 1.
#[inline(always)]
pub(super) fn coefficients(d: f32) -> [f32; POINTS] {
    let (a, b, c, e, f) = (d + 2.0, d + 1.0, d - 1.0, d - 2.0, d - 3.0);
    let (ab, ef) = (a * b, e * f);
    let (bd, dc) = (b * d, d * c);
    [
        bd * c * ef * (-1.0 / 120.0),
        a * dc * ef * (1.0 / 24.0),
        ab * c * ef * (-1.0 / 12.0),
        ab * d * ef * (1.0 / 12.0),
        ab * dc * f * (-1.0 / 24.0),
        ab * dc * e * (1.0 / 120.0),
    ]
}

/// What is left of a tone's amplitude at a frequency, radians per sample: root of the mean energy over all places between two
/// samples.
pub(super) fn gain_left(radians: f64) -> f64 {
    let energy = |place: u8| {
        let weights = coefficients((f32::from(place) + 0.5) / f32::from(PLACES)).into_iter().zip(0..);
        weights.map(|(w, n)| Complex64::cis(radians * f64::from(n)) * f64::from(w)).sum::<Complex64>().norm_sqr()
    };
    ((0..PLACES).map(energy).sum::<f64>() / f64::from(PLACES)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_between_samples_lose_what_is_said_of_them() {
        // Half the energy of a tone at 0.8 of half the rate, next to nothing below a third.
        assert!((gain_left(0.8 * std::f64::consts::PI) - 0.75).abs() < 0.03, "{}", gain_left(0.8 * std::f64::consts::PI));
        assert!(gain_left(std::f64::consts::PI / 3.0) > 0.995);
        let radians = 2.0_f32;
        let tone: Vec<f32> = (0..40_u8).map(|n| (radians * f32::from(n)).sin()).collect();
        let heard = |i: u16| f64::from(interpolate_one(&tone, 10.0 + f64::from(i) * 0.02));
        let energy: f64 = (0..1000).map(|i| heard(i).powi(2)).sum::<f64>() / 1000.0;
        assert!((energy.sqrt() / 0.5_f64.sqrt() / gain_left(f64::from(radians)) - 1.0).abs() < 0.03, "{energy}");
    }
}
