//! Arguments of `promenade surface`.

use super::reconstruction::ReconstructionArgs;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What a room is made into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shape {
    /// Six walls, where most points lie
    Box,
    /// The space that sight lines from cameras to their points cross, closed where nothing was seen
    Free,
}

#[derive(Debug, Args)]
pub(crate) struct SurfaceArgs {
    /// COLMAP model (its folder), points, 3D Gaussian splats or a mesh (.ply), or a mesh (.obj)
    pub(crate) source: PathBuf,
    /// Mesh to write, metres, z up, for `simulate`
    #[arg(short, long, value_name = "FILE.obj")]
    pub(crate) output: PathBuf,
    /// What to make of the points
    #[arg(long, value_enum, default_value_t = Shape::Box)]
    pub(crate) shape: Shape,
    /// Edge of the cells of free space, and of a mesh's sampling, metres [default: 0.1; of a mesh's sampling for a box 0.25]
    #[arg(long, value_name = "M")]
    pub(crate) cell: Option<f32>,
    /// Walk of a listener that the room holds besides all cameras, any form of camera path, in the room's coordinates
    #[arg(long, value_name = "WALK")]
    pub(crate) path: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) world: ReconstructionArgs,
}
