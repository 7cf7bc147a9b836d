//! From acoustics to scenes: a room of any kind gives images, what is seen of them and late energies, and [`Surfaces`] makes
//! the scene.
//!
//! Light enough to run in the plugin while a user draws a room. The baker makes its scenes of meshes with the same maker.

#![forbid(unsafe_code)]

mod bass;
mod energy_vector;
mod error;
mod late;
mod reverberation;
mod scene_head;
mod shoebox_room;
mod surfaces;

pub use bass::{CROSSOVERS_HZ, RoomBass, bass_axis, bass_places, crossover_hz, whole_hz};
pub use energy_vector::{EnergyVector, ear_energy};
pub use error::RoomError;
pub use late::{
    HopEnergies, LONGEST_EARLY_S, LateEnergies, SHORTEST_EARLY_S, early_taps, late_gain, sided, t20_end, time_filters,
};
pub use reverberation::{Matched, Missed, Some7, T20_S, factored, match_t20, measured_t20_s, t20_s};
pub use scene_head::SceneHead;
pub use shoebox_room::{PLAYED_IMAGES, SIZES_M, SceneOptions, ShoeboxRoom};
pub use surfaces::{LatePart, Places, Played, PlayedImage, Surfaces, outline};
