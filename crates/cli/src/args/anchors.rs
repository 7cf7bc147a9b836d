//! Arguments of `promenade anchors`.

use super::reconstruction::ReconstructionArgs;
use super::values::parse_lengths;
use clap::{ArgGroup, Args};
use promenade_core::glam::Vec3;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("place").args(["source", "size"]).required(true)))]
pub(crate) struct AnchorsArgs {
    /// COLMAP model (its folder), points, 3D Gaussian splats or a mesh (.ply), or a mesh (.obj)
    pub(crate) source: Option<PathBuf>,
    /// A box room from the origin to this corner instead, metres
    #[arg(long = "box", value_name = "X,Y,Z", value_parser = parse_lengths)]
    pub(crate) size: Option<Vec3>,
    /// Anchor file to write
    #[arg(short, long, value_name = "FILE.safetensors")]
    pub(crate) output: PathBuf,
    /// Anchors
    #[arg(short = 'n', long, value_name = "N", default_value_t = 256)]
    pub(crate) count: usize,
    /// Voxels around each anchor whose colours are its features
    #[arg(long, value_name = "K", default_value_t = 50)]
    pub(crate) neighbours: usize,
    /// Edge of the voxels in which points are merged, metres
    #[arg(long, value_name = "M", default_value_t = 0.25)]
    pub(crate) voxel: f32,
    /// Seed of the clustering and of a mesh's points
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) world: ReconstructionArgs,
}
