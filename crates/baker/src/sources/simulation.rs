//! Binaural responses of rooms that nobody has measured: image sources with HRTFs, and noise with the energy of what comes
//! after them.

mod bins;
mod box_room;
mod directivity;
mod early;
#[cfg(test)]
#[path = "simulation/tests/heads.rs"]
pub(crate) mod heads;
mod hrtf;
mod join;
mod low;
mod mesh_room;
mod part;
mod poses;
mod tail;
mod walls;

pub use box_room::simulate_box;
pub use directivity::directivity;
pub use hrtf::Hrtf;
pub use join::{is_complete, join, part_folder};
pub use mesh_room::{MeshOptions, Simulated, simulate_mesh};
pub use part::Part;
pub use poses::{Inside, along, fit, grid, random_inside, random_poses, scene_spacing_m, turned};
pub use promenade_acoustics::OCTAVES_HZ;
pub use promenade_core::network::SPEED_OF_SOUND_M_S;

pub(crate) use low::{Bass, Pilot};

/// Longest response, seconds.
pub const MAX_LENGTH_S: f32 = 10.0;
/// Least distance of a head from the emitter, metres.
const LEAST_DISTANCE_M: f32 = 0.1;
