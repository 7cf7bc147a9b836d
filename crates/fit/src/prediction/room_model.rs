//! What a prediction asks of a room.

use super::residual::Residual;
use crate::bands::{Bands, PerBand};
use crate::early::Chain;
use crate::measurements::{Measurement, Measurements};

/// A path of sound with its amplitudes.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrival {
    /// Length, metres.
    pub length_m: f64,
    /// Reflections.
    pub order: u32,
    /// Amplitudes by band, where the direct sound at 1 m on the axis has 1.
    pub gains: PerBand,
}

/// A room that tells of sound between any two places.
pub trait RoomModel: Sync {
    /// The chain of loudspeaker and microphone of the measurements that the room was fitted to; `None` of no measurements.
    fn chain(&self, set: &Measurements) -> Option<Chain>;

    /// Paths to a measurement's places of at most `reach_m` metres, the direct one first where it is free.
    fn arrivals(&self, at: &Measurement, bands: &Bands, reach_m: f64) -> Vec<Arrival>;

    /// Energies of what images do not have by bin since the source sounded, with the chain, octave by octave.
    fn late_energies(&self, set: &Measurements) -> Vec<Vec<f64>>;

    /// What surfaces do not explain.
    fn residual(&self) -> &Residual;
}
