//! Sines and cosines of a panel.

use super::panel::Row;
use crate::number::single;
use pulp::{Simd, WithSimd};
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// Sine and cosine of `frequency * x`, the product rounded to single precision, at every position of a panel.
///
/// Within 2e-7 of the exact sine and cosine of that product, for products up to 1e9.
pub(crate) struct Waves<'a> {
    pub(crate) frequency: f32,
    pub(crate) x: &'a Row,
    pub(crate) sin: &'a mut Row,
    pub(crate) cos: &'a mut Row,
}

impl WithSimd for Waves<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for ((x, sin), cos) in self.x.0.iter().zip(&mut self.sin.0).zip(&mut self.cos.0) {
            (*sin, *cos) = sin_cos(self.frequency * x);
        }
    }
}

/// The low half of a number's bits.
#[expect(clippy::cast_possible_truncation, reason = "the low half is meant")]
#[inline(always)]
fn low_bits(x: f64) -> u32 {
    x.to_bits() as u32
}

/// Without branches, so that a loop of them vectorises. The quarter turns are taken away in double precision, in which that is
/// exact enough and the same on all machines.
#[inline(always)]
fn sin_cos(x: f32) -> (f32, f32) {
    /// Adding and taking away 1.5 * 2^52 rounds to a whole number, which is left in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let x = f64::from(x);
    let shifted = x * FRAC_2_PI + ROUND;
    let r = single(x - (shifted - ROUND) * FRAC_PI_2);
    let quarters = low_bits(shifted);
    let q = r * r;
    // Minimax in a quarter turn about 0, coefficients of S. Moshier's Cephes library.
    let sin = r + r * q * (-0.166_666_55 + q * (0.008_332_161 - q * 1.951_529_6e-4));
    let cos = 1.0 - 0.5 * q + q * q * (0.041_666_646 + q * (-0.001_388_731_6 + q * 2.443_315_7e-5));
    let (s, c) = if quarters & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let turned = |value: f32, quarters: u32| f32::from_bits(value.to_bits() ^ ((quarters & 2) << 30));
    (turned(s, quarters), turned(c, quarters.wrapping_add(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pulp::Arch;

    #[test]
    fn sines_and_cosines_of_large_phases_are_exact() {
        for frequency in [1.0, 474.048, 1024.0] {
            for i in -400..400 {
                let x = Row(std::array::from_fn(|p| (i * 32 + p as i32) as f32 * 0.007_31));
                let (mut sin, mut cos) = (Row::default(), Row::default());
                Arch::new().dispatch(Waves { frequency, x: &x, sin: &mut sin, cos: &mut cos });
                for ((x, s), c) in x.0.iter().zip(sin.0).zip(cos.0) {
                    let phase = f64::from(frequency * x);
                    let off = (f64::from(s) - phase.sin()).abs().max((f64::from(c) - phase.cos()).abs());
                    assert!(off < 2e-7, "{phase}: {s} {c} off by {off}");
                }
            }
        }
    }

    #[test]
    fn phases_are_exact_up_to_1e9_and_points_of_the_circle_up_to_1e15() {
        for exponent in 3..=15 {
            for step in 0..1000 {
                let x = 10.0_f32.powi(exponent) * (1.0 - step as f32 * 0.000_731);
                let (s, c) = sin_cos(x);
                let off = (f64::from(s) - f64::from(x).sin()).abs().max((f64::from(c) - f64::from(x).cos()).abs());
                assert!(exponent > 9 || off < 2e-7, "{x}: {s} {c} off by {off}");
                assert!((s.hypot(c) - 1.0).abs() < 1e-5, "{x}: {s} {c}");
            }
        }
    }
}
