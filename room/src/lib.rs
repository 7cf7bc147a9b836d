//! From acoustics to scenes: energy over time as time filters, and box rooms as scenes of image sources.
//!
//! Light enough to run in the plugin while a user draws a room. The baker makes its scenes of meshes with the same time
//! filters.

#![forbid(unsafe_code)]

mod error;
mod late;
mod receiver;
mod shoebox_room;

pub use error::RoomError;
pub use late::{
    Flow, HopEnergies, LONGEST_EARLY_S, SHORTEST_EARLY_S, add_arrival, add_flow, decay_s, hop_energies, hop_flows, late_gain,
    time_filters,
};
pub use receiver::Receiver;
pub use shoebox_room::{PLAYED_IMAGES, SIZES_M, SceneOptions, ShoeboxRoom};
