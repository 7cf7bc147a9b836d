//! What walls leave of a sound.

use super::bins::Bins;
use super::{BoxRoom, OCTAVES_HZ};
use promenade_acoustics::BoxImage;
use promenade_fourier::num_complex::Complex32;

/// Amplitude that stands for 0, whose logarithm would be infinite.
const LEAST_AMPLITUDE: f64 = 1e-5;

/// Complex logarithms of the walls' reflection, by bin.
pub(super) fn walls(room: &BoxRoom, bins: Bins) -> [Vec<Complex32>; 6] {
    room.absorption.map(|absorption| {
        let amplitude = |hz: f64| {
            let absorbed = octave(&absorption, hz);
            (1.0 - absorbed).max(0.0).sqrt().max(LEAST_AMPLITUDE).ln()
        };
        bins.minimum_phase(amplitude)
    })
}

/// What they leave of an image's amplitude, by bin, from their complex logarithms.
pub(super) fn left(image: &BoxImage, walls: &[Vec<Complex32>; 6]) -> Vec<Complex32> {
    let hits = image.hits();
    (0..walls[0].len()).map(|k| walls.iter().zip(hits).map(|(w, n)| w[k] * n as f32).sum::<Complex32>().exp()).collect()
}

/// What they leave of an image's energy, in an octave.
pub(super) fn energy(room: &BoxRoom, image: &BoxImage, octave: usize) -> f64 {
    let left = |(a, n): (&super::Absorption, u32)| f64::from(1.0 - a[octave]).powi(n.cast_signed());
    room.absorption.iter().zip(image.hits()).map(left).product()
}

/// A value by octave at a frequency: linear over the logarithm of the frequency, held beyond the ends.
fn octave(values: &[f32; 7], hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let [a, b] = [values[below], values[below + 1]].map(f64::from);
    a + fraction * (b - a)
}

/// The octave below a frequency and how far it is on the way to the next.
pub(super) fn octave_place(hz: f64) -> (usize, f64) {
    let last = OCTAVES_HZ.len() - 1;
    let place = (hz.max(1.0) / f64::from(OCTAVES_HZ[0])).log2().clamp(0.0, last as f64);
    let below = (place as usize).min(last - 1);
    (below, place - below as f64)
}
