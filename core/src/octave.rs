//! The octaves that rooms are described in.

use crate::number::whole;

/// How many there are.
pub const OCTAVES: usize = 7;

/// Their centres, Hz.
pub const OCTAVES_HZ: [f32; OCTAVES] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// The octave around 1 kHz, an index of [`OCTAVES_HZ`].
pub const KILOHERTZ: usize = 3;

/// A number for each of [`OCTAVES_HZ`].
pub type Octaves = [f32; OCTAVES];

/// The octave that a frequency is in or nearest to, an index of [`OCTAVES_HZ`].
#[must_use]
pub fn nearest_octave(hz: f32) -> usize {
    OCTAVES_HZ.iter().position(|octave| hz < octave * std::f32::consts::SQRT_2).unwrap_or(OCTAVES - 1)
}

/// The octave below a frequency, the last but one at most, and how far it is on the way to the next, 0 to 1.
#[must_use]
pub fn octave_place(hz: f64) -> (usize, f64) {
    let place = (hz.max(1.0) / f64::from(OCTAVES_HZ[0])).log2().clamp(0.0, (OCTAVES - 1) as f64);
    let below = whole(place).min(OCTAVES - 2);
    (below, place - below as f64)
}

/// Energies by octave at a frequency: their levels lie between those of the octaves.
#[must_use]
pub fn octave_energy(energies: &[f64; OCTAVES], hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let [a, b] = [energies[below], energies[below + 1]];
    if a > 0.0 && b > 0.0 { a * (b / a).powf(fraction) } else { a + fraction * (b - a) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_lie_between_the_octaves_around_them() {
        assert_eq!([20.0, 176.0, 177.0, 1000.0, 20_000.0].map(nearest_octave), [0, 0, 1, KILOHERTZ, 6]);
        assert_eq!(
            [20.0, 125.0, 500.0, 8000.0, 20_000.0].map(octave_place),
            [(0, 0.0), (0, 0.0), (2, 0.0), (5, 1.0), (5, 1.0)]
        );
        let energies = [1.0, 4.0, 0.0, 2.0, 2.0, 2.0, 8.0];
        assert!((octave_energy(&energies, 125.0 * 2.0_f64.sqrt()) - 2.0).abs() < 1e-9);
        assert!((octave_energy(&energies, 500.0 * 2.0_f64.sqrt()) - 1.0).abs() < 1e-9, "a straight line from nothing");
    }
}
