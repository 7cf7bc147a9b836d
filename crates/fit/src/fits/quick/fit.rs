//! What a quick fit has found.

use super::image_gains::ImageGains;
use crate::bands::{Bands, Estimate, FITTED_HZ, measures};
use crate::early::Chain;
use crate::late::{BIN_S, Histories, ORDER, Octave, Surface};
use crate::measurements::{Measurement, Measurements};
use crate::prediction::{Arrival, Residual, RoomModel};
use crate::room::{BoxPath, Walls};
use promenade_acoustics::Air;

/// The fit of one octave.
#[derive(Clone, Debug, PartialEq)]
pub struct OctaveFit {
    /// Of each wall.
    pub absorption: [Estimate; 6],
    /// Of all walls alike.
    pub scattering: Estimate,
    /// Of the source.
    pub sharpness: Estimate,
    /// The source's energy on its axis at 1 m, dB.
    pub level_db: f64,
    /// Energy of the measured late part over that of the model, between 80 and 250 ms, dB, and measured T20 over the model's:
    /// what surfaces do not explain.
    pub residual_db: f64,
    /// See [`OctaveFit::residual_db`].
    pub residual_decay: f64,
    /// Energy of reflections up to 80 ms over that of the model's images, dB.
    pub residual_early_db: f64,
    /// Root mean square of what is left in T20, EDT, C80 and level, just noticeable differences.
    pub left_jnd: f64,
    /// Whether the responses decay far enough to be fitted at all.
    pub fitted: bool,
}

impl OctaveFit {
    /// As a model of energy over time, in some air.
    fn octave(&self, number: usize, air: &Air) -> Octave {
        let surface = |a: &Estimate| Surface { absorption: a.value, scattering: self.scattering.value };
        Octave {
            surfaces: self.absorption.each_ref().map(surface),
            sharpness: self.sharpness.value,
            air_per_m: air.energy_decay_per_m(FITTED_HZ[number]),
            speed_m_s: air.speed_m_s(),
        }
    }
}

/// The quick fit of a box.
#[derive(Clone, Debug)]
pub struct QuickFit {
    /// The room.
    pub walls: Walls,
    /// By octave, [`FITTED_HZ`].
    pub octaves: Vec<OctaveFit>,
    /// Whether sources face somewhere.
    pub facing: bool,
    /// The trace that it was made with.
    pub histories: Histories,
    /// What surfaces do not explain.
    pub residual: Residual,
}

impl QuickFit {
    /// What the model says of the reverberation time of an octave, with its residual, seconds; NaN where it has none.
    #[must_use]
    pub fn t20_s(&self, octave: usize) -> f64 {
        let model = self.octaves[octave].octave(octave, &self.histories.air);
        let [_, whole] = self.histories.energies(&model.surfaces, ORDER, model.air_per_m);
        measures(&whole, BIN_S)[0] * self.octaves[octave].residual_decay
    }

    /// Models of energy over time of all octaves.
    pub(crate) fn models(&self) -> Vec<Octave> {
        self.octaves.iter().enumerate().map(|(o, fit)| fit.octave(o, &self.histories.air)).collect()
    }
}

impl RoomModel for QuickFit {
    fn chain(&self, set: &Measurements) -> Option<Chain> {
        let levels: Vec<f64> = self.octaves.iter().map(|o| o.level_db).collect();
        Some(Chain::of(set)?.with_levels(&levels, f64::from(set.sample_rate_hz)))
    }

    fn arrivals(&self, at: &Measurement, bands: &Bands, reach_m: f64) -> Vec<Arrival> {
        let gains = ImageGains::of(&self.models(), bands);
        let facing = at.source.facing.filter(|_| self.facing);
        let arrival =
            |path: &BoxPath| Arrival { length_m: path.length_m, order: path.order(), gains: gains.gains(path, facing) };
        self.walls.paths(at.source.at_m, at.microphone.at_m, ORDER, reach_m).iter().map(arrival).collect()
    }

    fn late_energies(&self, _: &Measurements) -> Vec<Vec<f64>> {
        let levelled = |(model, fit): (&Octave, &OctaveFit)| {
            let mut energies = model.diffuse(&self.histories, self.facing);
            energies.iter_mut().for_each(|e| *e *= 10f64.powf(fit.level_db / 10.0));
            energies
        };
        self.models().iter().zip(&self.octaves).map(levelled).collect()
    }

    fn residual(&self) -> &Residual {
        &self.residual
    }
}
