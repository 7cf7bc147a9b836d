//! Gains and phases as complex numbers, many at a time.

use pulp::WithSimd;

/// Writes `gain * e^(i phase)` as real and imaginary parts; `gain = mixture * (1 + sign * difference)`.
///
/// Phases are radians up to about 1e4; the result is within 2e-6 of the exact phasor for phases below 100.
pub(crate) struct Phasors<'a> {
    pub(crate) mixture: &'a [f32],
    pub(crate) difference: &'a [f32],
    pub(crate) sign: f32,
    pub(crate) phase: &'a [f32],
    pub(crate) re: &'a mut [f32],
    pub(crate) im: &'a mut [f32],
}

impl WithSimd for Phasors<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let out = self.re.iter_mut().zip(self.im.iter_mut());
        for ((((re, im), m), d), p) in out.zip(self.mixture).zip(self.difference).zip(self.phase) {
            let gain = m * (1.0 + self.sign * d);
            let (sin, cos) = sin_cos(*p);
            *re = gain * cos;
            *im = gain * sin;
        }
    }
}

/// Sine and cosine without branches, so that a loop of them vectorises: series of the half angle, then the double angle.
#[inline(always)]
fn sin_cos(x: f32) -> (f32, f32) {
    const TURN: f32 = std::f32::consts::TAU;
    /// Adding and taking away 1.5 * 2^23 rounds to a whole number.
    const ROUND: f32 = 12_582_912.0;
    let turns = (x * (1.0 / TURN) + ROUND) - ROUND;
    let h = 0.5 * (x - turns * TURN);
    let q = h * h;
    let sin = h
        * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362_880.0 - q * (1.0 / 39_916_800.0))))));
    let cos = 1.0
        + q * (-0.5
            + q * (1.0 / 24.0
                + q * (-1.0 / 720.0 + q * (1.0 / 40_320.0 - q * (1.0 / 3_628_800.0 - q * (1.0 / 479_001_600.0))))));
    (2.0 * sin * cos, 1.0 - 2.0 * sin * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_library() {
        for i in -20_000..20_000 {
            let x = i as f32 * 0.003;
            let (s, c) = sin_cos(x);
            let (ws, wc) = (f64::from(x).sin(), f64::from(x).cos());
            assert!((f64::from(s) - ws).abs() < 1e-5 && (f64::from(c) - wc).abs() < 1e-5, "{x}: {s} {c}");
        }
    }
}
