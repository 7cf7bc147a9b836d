//! Test signals and measures of difference.

pub use promenade_testing::signal::*;

/// Uniform noise in [-0.5, 0.5), the same on every machine.
#[must_use]
pub fn noise(len: usize) -> Vec<f32> {
    Noise::new(1).take(len).map(|value| 0.5 * value).collect()
}
