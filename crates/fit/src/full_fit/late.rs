//! The late part of a full fit: rays' energies.

use super::FullFit;
use crate::bands::PerBand;
use crate::energy_model::BIN_S;
use crate::histories::Surface;
use crate::octaves::{FITTED_HZ, measures, split};

impl FullFit {
    /// Absorption of each surface and scattering in an octave of [`FITTED_HZ`].
    #[must_use]
    pub fn octave(&self, number: usize) -> Vec<Surface> {
        let mean = |values: &PerBand| self.bands.to_octaves(values)[number].clamp(0.0, 1.0);
        let scattering = mean(&self.scattering.map(|e| e.value));
        self.surfaces.iter().map(|s| Surface { absorption: mean(&s.absorption.map(|e| e.value)), scattering }).collect()
    }

    /// Energies that rays bring by bin since the source sounded, octave by octave, all and what images do not have, over that
    /// of the chain.
    fn rays(&self, number: usize) -> [Vec<f64>; 2] {
        let sent: PerBand = std::array::from_fn(|b| {
            let nodes = self.sent.len().max(1) as f64;
            let mean =
                if self.sent.is_empty() { 1.0 } else { self.sent.iter().map(|n| (2.0 * n[b]).exp()).sum::<f64>() / nodes };
            mean * (2.0 * self.level[b]).exp()
        });
        let level = self.bands.to_octaves(&sent)[number];
        let air = self.histories.air.energy_decay_per_m(FITTED_HZ[number]);
        let mut energies = self.histories.energies(&self.octave(number), self.order, air);
        energies.iter_mut().flatten().for_each(|e| *e *= level);
        energies
    }

    /// Reverberation time in an octave as rays and residual say, seconds; NaN where there is none.
    #[must_use]
    pub fn t20_s(&self, number: usize) -> f64 {
        let [mut diffuse, _] = self.rays(number);
        diffuse.iter_mut().enumerate().for_each(|(bin, e)| *e *= self.residual.at(number, bin));
        measures(&diffuse, BIN_S)[0]
    }

    /// The chain's energy by octave, dB.
    pub(crate) fn chain_db(&self, rate_hz: f64) -> Vec<f64> {
        let mut response: Vec<f32> = self.chain.response.iter().map(|v| *v as f32).collect();
        let length = response.len();
        response.resize(4 * length, 0.0);
        response.rotate_right(length);
        let db = |x: &Vec<f32>| 10.0 * x.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().max(1e-30).log10();
        split(&response, rate_hz).iter().map(db).collect()
    }
}

/// Energies of what images do not have by bin since the source sounded, with the chain, octave by octave.
pub(crate) fn late_energies(fit: &FullFit, rate_hz: f64) -> Vec<Vec<f64>> {
    fit.chain_db(rate_hz)
        .iter()
        .enumerate()
        .map(|(o, db)| {
            let [mut diffuse, _] = fit.rays(o);
            diffuse.iter_mut().for_each(|e| *e *= 10f64.powf(db / 10.0));
            diffuse
        })
        .collect()
}
