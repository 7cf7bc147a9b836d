//! What walls leave of a sound.

use super::bins::Bins;
use promenade_acoustics::Material;
use promenade_fourier::num_complex::Complex32;

/// Amplitude that stands for 0, whose logarithm would be infinite.
const LEAST_AMPLITUDE: f64 = 1e-5;

/// Complex logarithms, by bin, of what walls of these materials leave of what a mirror would send on.
pub(super) fn filters(materials: &[Material], bins: Bins) -> Vec<Vec<Complex32>> {
    let amplitude = |material: &Material, hz: f64| (1.0 - material.taken(hz)).max(0.0).sqrt().max(LEAST_AMPLITUDE).ln();
    materials.iter().map(|material| bins.minimum_phase(|hz| amplitude(material, hz))).collect()
}

/// What `filters` leave of the amplitude, by bin, each so many times.
pub(super) fn left(filters: &[Vec<Complex32>], times: &[f32]) -> Vec<Complex32> {
    let bins = filters.first().map_or(0, Vec::len);
    (0..bins).map(|k| filters.iter().zip(times).map(|(w, n)| w[k] * *n).sum::<Complex32>().exp()).collect()
}
