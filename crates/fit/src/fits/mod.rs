//! Rooms that are found from measurements: the quick fit of a box, and the full fit.

mod alike;
mod full;
mod quick;
mod saved;

pub use alike::{Alike, octave_t20_s};
pub use full::{Found, FullFit, FullOptions, SurfaceFit, VoxelFit, WallFound, full_fit};
pub use quick::{OctaveFit, QuickFit, quick_fit};
pub use saved::Saved;
