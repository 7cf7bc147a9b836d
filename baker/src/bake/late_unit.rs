//! What the render head's late part plays at unit gain.

use crate::bake::room::{HopEnergies, Room};
use crate::error::BakeError;
use crate::player::render_response;
use crate::signal::spectrum::Analyser;
use promenade_core::{Pose, Scene, StftGrid};
use std::sync::Arc;

/// Energy density per hop and band at each ear of the late part that the render head itself plays for a gain of 1, `hops` hops from the
/// direct sound on. It differs with the seed of its noise, and begins before the last tap.
pub(crate) fn late_unit(grid: &StftGrid, room: &Room, hops: usize) -> Result<[HopEnergies; 2], BakeError> {
    let mut transfer = room.shape.silent();
    transfer.late.fill(1.0);
    let scene = Scene::of_transfer(&transfer, *grid, room.bands.clone(), room.tail.clone(), room.top_hz)?;
    let lead = grid.n_fft;
    let ears = render_response(&Arc::new(scene), Pose::IDENTITY, lead, lead + (hops + 1) * grid.hop)?;
    let analyser = Analyser::new(*grid);
    Ok(ears.map(|ear| analyser.hop_energies(&ear, lead as i64, hops, &room.bands)))
}
