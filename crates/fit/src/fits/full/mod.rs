//! The full fit: geometry, places, surfaces, scattering and source of a room of flat walls from its measured responses.
//!
//! Rounds of descent (Adam), each about what was found before: the beginnings of responses against images and the mean power of
//! scattered sound, tied to the late part through rays. Places and walls move first, from coarse to fine frequencies; then
//! surfaces and source.

mod appearance_prior;
mod descent;
mod errors;
mod field;
mod fit;
mod patch_errors;
mod patch_fit;
mod patches;
mod rescue;
mod result;
mod schedule;

pub use fit::{Found, FullFit, SurfaceFit, WallFound};
pub use patches::VoxelFit;
pub use schedule::FullOptions;

use crate::bands::BANDS;
use crate::early::{Chain, EarlyModel, NODES, Nodes, Prior, Unknowns};
use crate::error::FitError;
use crate::measurements::{LEAST_RESPONSES, Measurements, distance};
use crate::room::FlatRoom;
use descent::Descent;

/// Directivity of a small loudspeaker by octave from 63 Hz: the sharpness of amplitudes `exp(sharpness (cos - 1))`.
const LOUDSPEAKER_SHARPNESS: [f64; 8] = [0.03, 0.05, 0.1, 0.25, 0.5, 0.8, 1.2, 1.6];
/// Source and microphone at least this far apart are different places, metres.
const SAME_PLACE_M: f64 = 1e-3;

/// Fits a room to measurements. `each` is told the share of the work that is done after every round.
///
/// # Errors
/// A source or a microphone outside of the room, fewer than three measurements.
pub fn full_fit(
    room: &FlatRoom,
    set: &Measurements,
    options: &FullOptions,
    each: &mut dyn FnMut(f64),
) -> Result<FullFit, FitError> {
    let Some(chain) = Chain::of(set) else {
        return Err(FitError::argument("measurements", "at least one", "none"));
    };
    if set.all.len() < LEAST_RESPONSES {
        return Err(FitError::argument("measurements", format!("at least {LEAST_RESPONSES} responses"), set.all.len()));
    }
    set.check_within(room.bounds())?;
    let all_face = set.all.iter().all(|m| m.source.facing.is_some());
    let one_source = set.all.iter().all(|m| distance(m.source.at_m, set.all[0].source.at_m) < SAME_PLACE_M);
    // Sources in several places whose facing is not known have no directions in common.
    let nodes = if options.source && (all_face || one_source) { NODES } else { 0 };
    let u = Unknowns { surfaces: room.surfaces.len(), nodes, walls: room.walls.len(), places: set.all.len() };
    let model = EarlyModel::new(u, set, &chain, options.order, options.window_s);
    let sharpness = if all_face { model.bands.from_octaves(&LOUDSPEAKER_SHARPNESS) } else { [0.0; BANDS] };
    let prior = Prior::new(&u, set, &model.bands, &sharpness, &Nodes::new(nodes).cosines(), all_face);
    let fit = Descent { model, prior, options, chain };
    fit.run(room, each)
}
