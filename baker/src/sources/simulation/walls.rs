//! What walls leave of a sound.

use super::bins::Bins;
use promenade_acoustics::{Octaves, octave_place};
use promenade_fourier::num_complex::Complex32;

/// Amplitude that stands for 0, whose logarithm would be infinite.
const LEAST_AMPLITUDE: f64 = 1e-5;

/// Complex logarithms, by bin, of what walls leave that take these shares of the energy.
pub(super) fn filters(taken: &[Octaves], bins: Bins) -> Vec<Vec<Complex32>> {
    let filter = |taken: &Octaves| {
        let amplitude = |hz: f64| (1.0 - octave(taken, hz)).max(0.0).sqrt().max(LEAST_AMPLITUDE).ln();
        bins.minimum_phase(amplitude)
    };
    taken.iter().map(filter).collect()
}

/// What `filters` leave of the amplitude, by bin, each so many times.
pub(super) fn left(filters: &[Vec<Complex32>], times: &[f32]) -> Vec<Complex32> {
    let bins = filters.first().map_or(0, Vec::len);
    (0..bins).map(|k| filters.iter().zip(times).map(|(w, n)| w[k] * *n).sum::<Complex32>().exp()).collect()
}

/// A value by octave at a frequency: linear over the logarithm of the frequency, held beyond the ends.
pub(super) fn octave(values: &Octaves, hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let [a, b] = [values[below], values[below + 1]].map(f64::from);
    a + fraction * (b - a)
}
