//! Samples between samples: a B-spline of the fifth degree through them.
//!
//! A spline goes through samples whose shares of it have been found by a filter first (Unser, Aldroubi and Eden, "B-spline
//! signal processing", IEEE Transactions on Signal Processing 41 (1993)). That filter is the same for every place, so that all
//! images share it, and what is between the samples then keeps its treble.

use crate::number::{single, whole};
use pulp::Simd;

/// Samples that the interpolation reaches before and after its place.
pub(crate) const BEFORE: usize = 2;
pub(crate) const AFTER: usize = 3;
pub(super) const POINTS: usize = BEFORE + 1 + AFTER;
/// Samples on either side that shares are made of; what lies beyond is less than a thousandth.
pub(super) const REACH: usize = 8;
/// Roots within the unit circle of `z^4 + 26 z^3 + 66 z^2 + 26 z + 1`.
const ROOTS: [f64; 2] = [-0.430_575_347_099_973_6, -0.043_096_288_203_264_65];
/// By power of the place, 120 times what each share has of it.
const PIECES: [[f32; POINTS]; 6] = [
    [1.0, 26.0, 66.0, 26.0, 1.0, 0.0],
    [-5.0, -50.0, 0.0, 50.0, 5.0, 0.0],
    [10.0, 20.0, -60.0, 20.0, 10.0, 0.0],
    [-10.0, 20.0, 0.0, -20.0, 10.0, 0.0],
    [5.0, -20.0, 30.0, -20.0, 5.0, 0.0],
    [-1.0, 5.0, -10.0, 10.0, -5.0, 1.0],
];

/// Finds the shares of samples in the spline through them, which come [`REACH`] samples later.
pub(super) struct Shares {
    /// What a share has of its own sample and of those at each distance.
    taps: [f32; REACH + 1],
    /// The newest samples before those that are taken, and room for these.
    input: Vec<f32>,
}

impl Shares {
    /// For at most `most` samples at a time.
    pub(super) fn new(most: usize) -> Self {
        let [a, b] = ROOTS;
        let scale = 120.0 * a * b / ((a - b) * (1.0 - a * b));
        let tap = |far: usize| {
            let power = |root: f64| std::iter::repeat_n(root, far + 1).product::<f64>() / (1.0 - root * root);
            // The last one has all that follows too, so that a constant stays what it is.
            let rest = if far == REACH { (1.0 - a).recip() } else { 1.0 };
            single(scale * (power(a) - power(b)) * rest)
        };
        Self { taps: std::array::from_fn(tap), input: vec![0.0; 2 * REACH + most] }
    }

    /// Writes the shares of the samples [`REACH`] before each of `samples`.
    pub(super) fn of(&mut self, samples: &[f32], out: &mut [f32]) {
        let count = samples.len();
        self.input[2 * REACH..][..count].copy_from_slice(samples);
        let at = |shift: usize| &self.input[shift..][..count];
        out.iter_mut().zip(at(REACH)).for_each(|(out, x)| *out = self.taps[0] * x);
        for far in 1..=REACH {
            let pairs = at(REACH - far).iter().zip(at(REACH + far));
            out.iter_mut().zip(pairs).for_each(|(out, (a, b))| *out += self.taps[far] * (a + b));
        }
        self.input.copy_within(count..count + 2 * REACH, 0);
    }

    pub(super) fn reset(&mut self) {
        self.input.fill(0.0);
    }
}

/// The spline of six shares, `x[lane..lane + POINTS]` of each lane, at places from the third of them on, near 0 to 1.
#[inline(always)]
pub(super) fn interpolate<S: Simd>(simd: S, x: &[f32], places: S::f32s) -> S::f32s {
    let splat = |value: f32| simd.splat_f32s(value / 120.0);
    let mul = |a, value| simd.mul_f32s(a, splat(value));
    let add = |a, value, sum| simd.mul_add_e_f32s(a, splat(value), sum);
    let next = |sum, power| simd.mul_add_e_f32s(sum, places, power);
    let x = |j: usize| S::as_simd_f32s(&x[j..j + S::F32_LANES]).0[0];
    let (a, b, c, d, e, f) = (x(0), x(1), x(2), x(3), x(4), x(5));
    // All powers but the last are even or odd about the third share: see `PIECES`.
    let (outer, inner) = (simd.add_f32s(a, e), simd.add_f32s(b, d));
    let (outer_slope, inner_slope) = (simd.sub_f32s(e, a), simd.sub_f32s(d, b));
    let last = add(simd.sub_f32s(b, e), 5.0, mul(simd.sub_f32s(f, a), 1.0));
    let last = add(simd.sub_f32s(d, c), 10.0, last);
    let sum = next(last, add(c, 30.0, add(inner, -20.0, mul(outer, 5.0))));
    let sum = next(sum, add(inner_slope, -20.0, mul(outer_slope, 10.0)));
    let sum = next(sum, add(c, -60.0, add(inner, 20.0, mul(outer, 10.0))));
    let sum = next(sum, add(inner_slope, 50.0, mul(outer_slope, 5.0)));
    next(sum, add(c, 66.0, add(inner, 26.0, mul(outer, 1.0))))
}

/// The spline's value at one place among shares, counted from the first of them.
#[inline(always)]
pub(super) fn interpolate_one(x: &[f32], at: f64) -> f32 {
    let start = whole(at);
    let place = single(at - start as f64);
    let near = &x[start - BEFORE..][..POINTS];
    let power = |shares: &[f32; POINTS]| near.iter().zip(shares).map(|(x, share)| x * share).sum::<f32>();
    PIECES.iter().rev().fold(0.0, |sum, shares| sum * place + power(shares)) / 120.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::LANES;
    use crate::simd::tests::arches;
    use pulp::WithSimd;

    /// The shares of a tone of some radians a sample, and of what it is.
    fn shares(radians: f64, len: u16) -> Vec<f32> {
        let tone: Vec<f32> = (0..len).map(|n| single((radians * f64::from(n)).sin())).collect();
        let mut finder = Shares::new(tone.len() + REACH);
        let mut out = vec![0.0; tone.len()];
        finder.of(&tone, &mut out);
        out.split_off(REACH)
    }

    #[test]
    fn tones_between_samples_keep_their_level() {
        // Up to 14 kHz of a rate of 48.
        for tenths in [0.5, 2.0, 4.0, 5.83] {
            let radians = 0.1 * tenths * std::f64::consts::PI;
            let shares = shares(radians, 200);
            for place in (0..10).map(|i| 0.1 * f64::from(i)) {
                let heard = |n: u16| f64::from(interpolate_one(&shares, f64::from(n) + place));
                // Under a window of 150 samples, whose sum is 75.
                let (mut along, mut across) = (0.0, 0.0);
                for n in 0..150 {
                    let window = (f64::from(n) * std::f64::consts::PI / 150.0).sin().powi(2);
                    let (sin, cos) = (radians * (f64::from(20 + n) + place)).sin_cos();
                    along += window * heard(20 + n) * sin;
                    across += window * heard(20 + n) * cos;
                }
                let level_db = 20.0 * (along.hypot(across) / 37.5).log10();
                assert!(level_db.abs() < 0.1, "{tenths} {place}: {level_db} dB");
            }
        }
    }

    #[test]
    fn lanes_are_what_one_is() {
        struct Lanes<'a>(&'a [f32], &'a mut [f32]);
        impl WithSimd for Lanes<'_> {
            type Output = ();
            fn with_simd<S: Simd>(self, simd: S) {
                let places = simd.splat_f32s(0.3);
                S::as_mut_simd_f32s(&mut self.1[..S::F32_LANES]).0[0] = interpolate(simd, self.0, places);
            }
        }
        let shares = shares(1.3, 60);
        for arch in arches() {
            let mut out = [0.0; LANES];
            arch.dispatch(Lanes(&shares, &mut out));
            for (n, found) in out.iter().enumerate().filter(|(_, found)| **found != 0.0) {
                let want = interpolate_one(&shares, (n + BEFORE) as f64 + 0.3);
                assert!((found - want).abs() < 1e-6, "{n}: {found}, {want}");
            }
        }
    }
}
