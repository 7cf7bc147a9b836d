//! Amplitudes of images in a box of which octaves are known.

use crate::bands::{Bands, PerBand};
use crate::late::Octave;
use crate::room::{BoxPath, dot};

/// What a box does to images, by band.
pub(super) struct ImageGains {
    /// Amplitude that each wall's mirror leaves.
    walls: [PerBand; 6],
    /// Sharpness of the source.
    sharpness: PerBand,
    /// Decay of the energy in air, per metre.
    air_per_m: PerBand,
}

impl ImageGains {
    /// Of the octaves of a fit.
    pub(super) fn of(octaves: &[Octave], bands: &Bands) -> Self {
        let all = |of: &dyn Fn(&Octave) -> f64| bands.from_octaves(&octaves.iter().map(of).collect::<Vec<f64>>());
        let wall = |w: usize| {
            let left = |o: &Octave| ((1.0 - o.surfaces[w].absorption) * (1.0 - o.surfaces[w].scattering)).max(1e-9).ln();
            all(&left).map(|l| (0.5 * l).exp())
        };
        Self { walls: std::array::from_fn(wall), sharpness: all(&|o| o.sharpness), air_per_m: all(&|o| o.air_per_m) }
    }

    /// Amplitudes of a path where the direct sound at 1 m on the axis has 1.
    pub(super) fn gains(&self, path: &BoxPath, facing: Option<[f64; 3]>) -> PerBand {
        let off_axis = facing.map_or(0.0, |f| dot(f, path.departure) - 1.0);
        std::array::from_fn(|b| {
            let walls: f64 = self.walls.iter().zip(path.hits).map(|(w, n)| w[b].powi(i32::from(n))).product();
            let rest = self.sharpness[b] * off_axis - 0.5 * self.air_per_m[b] * path.length_m;
            walls * rest.exp() / path.length_m
        })
    }
}
