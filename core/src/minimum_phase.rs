//! Levels between octaves, and the minimum phase that they have.

use crate::octave::OCTAVES;
use std::f64::consts::{LN_2, PI};

/// Frequencies that gains are given at, Hz: walls are known from the octave of 63 Hz to that of 8 kHz, air beyond.
pub(crate) const GIVEN_HZ: [f32; 9] = [62.5, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16_000.0];
/// Natural logarithms of gains at [`GIVEN_HZ`].
pub(crate) type LogGains = [f32; GIVEN_HZ.len()];
/// Steps of an integral between two octaves.
const STEPS: u32 = 64;

/// The octave from 125 Hz to 8 kHz whose value holds at one of [`GIVEN_HZ`] where none of its own is known.
pub(crate) fn octave_of(given: usize) -> usize {
    given.saturating_sub(1).min(OCTAVES - 1)
}

/// Shares of the given values in one at a frequency: linear over the logarithm of frequency, the ends hold.
pub(crate) fn magnitude(hz: f64) -> [f64; GIVEN_HZ.len()] {
    let last = GIVEN_HZ.len() - 1;
    let place = (hz / f64::from(GIVEN_HZ[0])).log2().clamp(0.0, last as f64);
    std::array::from_fn(|octave| (1.0 - (place - octave as f64).abs()).max(0.0))
}

/// Minimum phase at a frequency, radians by natural logarithm of each gain (Bode 1945: the slope over the logarithm of
/// frequency, weighted by `ln coth |u / 2|`).
pub(crate) fn phase(hz: f64) -> [f64; GIVEN_HZ.len()] {
    let mut out = [0.0; GIVEN_HZ.len()];
    for (lower, pair) in GIVEN_HZ.windows(2).enumerate() {
        let start = (f64::from(pair[0]) / hz).ln();
        let step = LN_2 / f64::from(STEPS);
        let weight: f64 = (0..STEPS)
            .map(|i| (start + (f64::from(i) + 0.5) * step).abs().max(1e-3))
            .map(|u| -(0.5 * u).tanh().ln() * step)
            .sum();
        let slope = weight / (PI * LN_2);
        out[lower] -= slope;
        out[lower + 1] += slope;
    }
    out
}
