//! Energy over time at a place in a room of given surfaces, by octave.
//!
//! The direct sound and images up to an order at their own times, and what walls have scattered, and images of higher order,
//! as their mean over the room ([`Histories`]): nothing is counted twice.

use super::histories::{Histories, Surface};
use crate::room::BoxPath;

/// Reflections of images.
pub(crate) const ORDER: u32 = 8;
/// Directivity of a small loudspeaker by octave from 63 Hz: the sharpness of amplitudes `exp(sharpness (cos - 1))`.
pub(crate) const LOUDSPEAKER_SHARPNESS: [f64; 8] = [0.03, 0.05, 0.1, 0.25, 0.5, 0.8, 1.2, 1.6];
/// Length of a bin, seconds.
pub(crate) const BIN_S: f64 = 0.004;

/// What a source and six walls do in one octave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Octave {
    /// Of each wall.
    pub(crate) surfaces: [Surface; 6],
    /// How the source's sound becomes less beside its axis: amplitudes of `exp(sharpness (cos - 1))`.
    pub(crate) sharpness: f64,
    /// Energy left after a metre of air is `exp(-air_per_m)`.
    pub(crate) air_per_m: f64,
    /// The speed of sound, metres per second.
    pub(crate) speed_m_s: f64,
}

impl Octave {
    /// Energy in a direction, by the cosine of its angle to the axis, over that on the axis.
    #[must_use]
    pub(crate) fn directivity(&self, cosine: f64) -> f64 {
        (2.0 * self.sharpness * (cosine - 1.0)).exp()
    }

    /// The mean of [`Self::directivity`] over all directions.
    #[must_use]
    pub(crate) fn mean_directivity(&self) -> f64 {
        let k = 4.0 * self.sharpness;
        if k < 1e-6 { 1.0 } else { (1.0 - (-k).exp()) / k }
    }

    /// Energy of a path where that of the direct sound at 1 m on the axis is 1.
    #[must_use]
    pub(crate) fn energy(&self, path: &BoxPath, facing: Option<[f64; 3]>) -> f64 {
        let walls: f64 = self
            .surfaces
            .iter()
            .zip(path.hits)
            .map(|(s, n)| ((1.0 - s.absorption) * (1.0 - s.scattering)).powi(i32::from(n)))
            .product();
        let cosine = facing.map_or(1.0, |f| f.iter().zip(path.departure).map(|(a, b)| a * b).sum());
        let directivity = if facing.is_some() { self.directivity(cosine) } else { 1.0 };
        directivity * walls * (-self.air_per_m * path.length_m).exp() / path.length_m.powi(2)
    }

    /// Energies by bin from the direct sound on, of all walls' diffuse sound.
    #[must_use]
    pub(crate) fn diffuse(&self, histories: &Histories, facing: bool) -> Vec<f64> {
        let [mut diffuse, _] = histories.energies(&self.surfaces, ORDER, self.air_per_m);
        if facing {
            diffuse.iter_mut().for_each(|e| *e *= self.mean_directivity());
        }
        diffuse
    }

    /// Energies by bin at a place, from its direct sound on. The first of `paths` is the direct sound.
    #[must_use]
    pub(crate) fn at(&self, paths: &[BoxPath], facing: Option<[f64; 3]>, diffuse: &[f64]) -> Vec<f64> {
        let direct_s = paths.first().map_or(0.0, |p| p.length_m) / self.speed_m_s;
        // Bins of the diffuse sound begin with the source, those of the place with the direct sound.
        let shift = direct_s / BIN_S;
        let (whole, fraction) = (shift as usize, shift.fract());
        let from = |i: usize| diffuse.get(i).copied().unwrap_or(0.0);
        let mut bins: Vec<f64> =
            (0..diffuse.len()).map(|i| from(i + whole) * (1.0 - fraction) + from(i + whole + 1) * fraction).collect();
        for path in paths {
            let bin = ((path.length_m / self.speed_m_s - direct_s) / BIN_S) as usize;
            if let Some(slot) = bins.get_mut(bin) {
                *slot += self.energy(path, facing);
            }
        }
        bins
    }
}
