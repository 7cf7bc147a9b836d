//! What walls leave of a sound.

use super::bins::Bins;
use promenade_acoustics::Material;
use promenade_fourier::num_complex::Complex32;

/// Complex logarithms, by bin, of what walls of these materials leave of what a mirror would send on.
pub(super) fn filters(materials: &[Material], bins: Bins) -> Vec<Vec<Complex32>> {
    materials.iter().map(|material| bins.minimum_phase(|hz| (1.0 - material.taken(hz)).max(0.0).sqrt())).collect()
}

/// What `filters` leave of the amplitude, by bin, each so many times.
pub(super) fn left(filters: &[Vec<Complex32>], times: &[f32]) -> Vec<Complex32> {
    let bins = filters.first().map_or(0, Vec::len);
    (0..bins).map(|k| filters.iter().zip(times).map(|(w, n)| w[k] * *n).sum::<Complex32>().exp()).collect()
}
