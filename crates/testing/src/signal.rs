//! Test signals and measures of difference.

use std::f64::consts::TAU;

/// Uniform white noise in [-1, 1) without end, the same on every machine.
#[derive(Clone, Debug)]
pub struct Noise(fastrand::Rng);

impl Noise {
    /// Noise of its own for each seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// The next value.
    pub fn value(&mut self) -> f32 {
        2.0 * self.0.f32() - 1.0
    }
}

impl Iterator for Noise {
    type Item = f32;

    fn next(&mut self) -> Option<f32> {
        Some(self.value())
    }
}

/// A value in [-1, 1) for each pair.
#[must_use]
pub fn noise_at(seed: u64, index: usize) -> f32 {
    Noise::new(seed << 40 | index as u64).value()
}

/// The first `len` values of a [`Noise`].
#[must_use]
pub fn noise(seed: u64, len: usize) -> Vec<f32> {
    Noise::new(seed).take(len).collect()
}

/// A sine of amplitude 0.5.
#[must_use]
pub fn sine(hz: f64, rate: f64, len: usize) -> Vec<f32> {
    (0..len).map(|i| (0.5 * (TAU * hz * i as f64 / rate).sin()) as f32).collect()
}

/// A one at `at`, zeros elsewhere.
#[must_use]
pub fn impulse(at: usize, len: usize) -> Vec<f32> {
    let mut signal = vec![0.0; len];
    signal[at] = 1.0;
    signal
}

/// The index of the largest magnitude.
#[must_use]
pub fn peak_index(signal: &[f32]) -> usize {
    let loudest = signal.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    loudest.map_or(0, |(index, _)| index)
}

/// The largest magnitude.
#[must_use]
pub fn peak(signal: &[f32]) -> f32 {
    signal.iter().fold(0.0, |loudest, sample| loudest.max(sample.abs()))
}

/// The largest difference of two stereo signals, dB full scale.
#[must_use]
pub fn difference_db(a: &[Vec<f32>; 2], b: &[Vec<f32>; 2]) -> f32 {
    assert_eq!(a[0].len(), b[0].len());
    let difference = |x: &[f32], y: &[f32]| x.iter().zip(y).fold(0.0_f32, |most, (x, y)| most.max((x - y).abs()));
    20.0 * difference(&a[0], &b[0]).max(difference(&a[1], &b[1])).max(1e-12).log10()
}

/// The index of the first sample at which two stereo signals differ.
#[must_use]
pub fn first_difference(a: &[Vec<f32>; 2], b: &[Vec<f32>; 2]) -> Option<usize> {
    let differ = |i: &usize| a[0][*i].to_bits() != b[0][*i].to_bits() || a[1][*i].to_bits() != b[1][*i].to_bits();
    (0..a[0].len()).find(differ)
}

/// Root of the mean square.
#[must_use]
pub fn rms(signal: &[f32]) -> f64 {
    let squares = signal.iter().map(|s| f64::from(*s) * f64::from(*s)).sum::<f64>();
    (squares / signal.len().max(1) as f64).sqrt()
}

/// The largest step from one sample to the next.
#[must_use]
pub fn largest_step(signal: &[f32]) -> f32 {
    signal.windows(2).fold(0.0, |most, pair| most.max((pair[1] - pair[0]).abs()))
}
