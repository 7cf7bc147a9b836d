//! The direct sound alone, and a tail with the energies that were measured in the median over places.

use super::predict::Prediction;
use super::residual::Residual;
use super::room_model::{Arrival, RoomModel};
use crate::bands::{BANDS, Bands, octaves_at};
use crate::early::Chain;
use crate::late::BIN_S;
use crate::measurements::{Measurement, Measurements};

/// No room: its residual is all of the reverberation.
#[derive(Debug, Default)]
pub(super) struct NoRoom {
    residual: Residual,
}

impl NoRoom {
    /// Of measurements; `None` of none.
    pub(super) fn of(set: &Measurements) -> Option<Self> {
        let bare = Self::default();
        let residual = Prediction::new(&bare, set)?.residual_of(set);
        Some(Self { residual })
    }
}

impl RoomModel for NoRoom {
    fn chain(&self, set: &Measurements) -> Option<Chain> {
        Chain::of(set)
    }

    fn arrivals(&self, at: &Measurement, _: &Bands, _: f64) -> Vec<Arrival> {
        let length_m = at.distance_m();
        vec![Arrival { length_m, order: 0, gains: [1.0 / length_m; BANDS] }]
    }

    fn late_energies(&self, set: &Measurements) -> Vec<Vec<f64>> {
        // Energies are the residual's over this one, which is so small that no floor of it is met.
        let rate_hz = f64::from(set.sample_rate_hz);
        let length = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0);
        let far = set.all.iter().map(Measurement::distance_m).fold(0.0, f64::max);
        let bins = ((length as f64 / rate_hz + far / set.air.speed_m_s()) / BIN_S) as usize + 4;
        vec![vec![1e-6; bins]; octaves_at(rate_hz)]
    }

    fn residual(&self) -> &Residual {
        &self.residual
    }
}
