//! Rooms of flat walls: boxes and meshes, their image-source paths, and their surfaces in patches.

mod flat_room;
mod paths;
mod vectors;
mod voxels;
mod wall;
mod walls;

pub use flat_room::{FlatRoom, Form};
pub use paths::{Path, Sequences};
pub(crate) use vectors::dot;
pub use voxels::{MOST_PATCHES, Patch, Voxels};
pub use wall::FlatWall;
pub(crate) use walls::outwards;
pub use walls::{BoxPath, WALLS, Walls};
