//! Conversions between numbers that lose what does not matter here; out of range they saturate.

/// A number in single precision.
#[expect(clippy::cast_possible_truncation, reason = "saturates to infinity")]
pub(crate) fn narrow(value: f64) -> f32 {
    value as f32
}

/// A sample as hosts take it: 0 for subnormal numbers, which would slow down what follows, and for what is no finite number.
pub(crate) fn normal(sample: f32) -> f32 {
    if sample.is_normal() { sample } else { 0.0 }
}

/// The whole part of a number as an index; 0 for negative numbers and NaN.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
pub(crate) fn index(value: f32) -> usize {
    value as usize
}

/// The whole part of a number; 0 for negative numbers and NaN.
#[cfg(feature = "standalone")]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
pub(crate) fn whole(value: f64) -> u32 {
    value as u32
}

/// The nearest whole number; 0 for NaN.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
pub(crate) fn rounded(value: f32) -> i32 {
    value.round() as i32
}

/// The whole part of a number as a byte.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
pub(crate) fn byte(value: f32) -> u8 {
    value as u8
}
