//! Arguments of `promenade surface`.

use super::reconstruction::ReconstructionArgs;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What a room is made into.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shape {
    /// Six walls, where most points lie
    Box,
    /// The convex hull
    Hull,
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
    /// Edge of the cells that a hull's corners lie in, and of a mesh's sampling, metres
    #[arg(long, value_name = "M", default_value_t = 0.25)]
    pub(crate) cell: f32,
    #[command(flatten)]
    pub(crate) world: ReconstructionArgs,
}
