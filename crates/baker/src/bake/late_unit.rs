//! What the render head's late part plays at unit gain.

use crate::error::BakeError;
use crate::signal::spectrum::Analyser;
use promenade_core::{Bands, Pose, Scene, StftGrid, TailModel, TransferFunction, TransferShape};
use promenade_player::render_response;
use promenade_room::HopEnergies;
use std::sync::Arc;

/// The late part of a room.
pub(crate) struct Late<'a> {
    pub(crate) grid: &'a StftGrid,
    pub(crate) bands: &'a Bands,
    pub(crate) tail: &'a TailModel,
    pub(crate) shape: TransferShape,
    pub(crate) top_hz: f32,
}

impl Late<'_> {
    /// Energy density per hop and band at each ear that the render head itself plays for a gain of 1, `hops` hops from the
    /// direct sound on. It differs with the seed of its noise, and begins before the last tap.
    pub(crate) fn unit(&self, hops: usize) -> Result<[HopEnergies; 2], BakeError> {
        let mut transfer = self.shape.silent();
        transfer.late.fill(1.0);
        self.plays(&transfer, hops)
    }

    /// Energy density per hop and band at each ear that the render head plays of time filters.
    pub(crate) fn plays(&self, transfer: &TransferFunction, hops: usize) -> Result<[HopEnergies; 2], BakeError> {
        let scene = Scene::of_transfer(transfer, *self.grid, self.bands.clone(), self.tail.clone(), self.top_hz)?;
        let lead = self.grid.n_fft;
        let ears = render_response(&Arc::new(scene), Pose::IDENTITY, lead, lead + (hops + 1) * self.grid.hop)?;
        let analyser = Analyser::new(*self.grid);
        Ok(ears.map(|ear| analyser.hop_energies(&ear, lead as i64, hops, self.bands)))
    }
}
