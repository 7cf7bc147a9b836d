//! Conversions between kinds of numbers, the only places where digits may be lost.

/// The nearest number of single precision.
#[expect(clippy::cast_possible_truncation, reason = "rounds")]
#[inline(always)]
pub(crate) fn single(x: f64) -> f32 {
    x as f32
}

/// The whole part; 0 of what is negative or not a number.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
#[inline(always)]
pub(crate) fn whole(x: f64) -> usize {
    x as usize
}

/// The whole part, of either sign; 0 of what is not a number.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
pub(crate) fn whole_signed(x: f64) -> i64 {
    x as i64
}

/// A small count as an exponent.
pub(crate) fn exponent(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

/// The largest magnitude of what is heard, +120 dBFS.
pub(crate) const LOUDEST: f32 = 1e6;

/// A sample as hosts take it: no subnormal number, which would slow down what follows, and none beyond [`LOUDEST`].
#[inline(always)]
pub(crate) fn bounded(x: f32) -> f32 {
    // In this form it takes several samples at once.
    let magnitude = x.abs();
    if (f32::MIN_POSITIVE..f32::INFINITY).contains(&magnitude) { x.clamp(-LOUDEST, LOUDEST) } else { 0.0 }
}

/// A sample as it comes from a host: silence where it is no number.
#[inline(always)]
pub(crate) fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}
