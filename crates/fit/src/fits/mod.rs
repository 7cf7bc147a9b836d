//! Rooms that are found from measurements.

mod alike;
mod full;

pub use alike::{Alike, octave_t20_s};
pub use full::{Found, FullFit, FullOptions, SurfaceFit, VoxelFit, WallFound, full_fit};
