//! Arguments of what corrects a simulated room.

use super::air::AirArgs;
use super::mesh::MeshArgs;
use super::simulate::parse_rule;
use clap::Args;
use std::path::PathBuf;

/// A room that is simulated for the places of recordings.
#[derive(Debug, Args)]
pub(crate) struct SimulationArgs {
    /// Mesh of a coarse or fitted room, whose sound the network is given and corrects; materials are those of --materials, of
    /// a file that a fit has left beside it, or of the groups' names
    #[arg(long, visible_alias = "room", value_name = "ROOM")]
    pub(crate) simulate: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) world: MeshArgs,
    /// Materials of the room's groups, as in `simulate`
    #[arg(long, value_name = "RULES", value_delimiter = ',', value_parser = parse_rule, requires = "simulate")]
    pub(crate) materials: Vec<(String, String)>,
    /// Head of the simulation: free-field responses all around it, a SOFA file or a set of responses
    #[arg(long, value_name = "FILE.sofa", requires = "simulate")]
    pub(crate) head: Option<PathBuf>,
    /// What emitters send where: omni, subcardioid, cardioid, supercardioid, figure-of-eight or a SOFA file [default: as a fit
    /// has left it beside the mesh, or omni]
    #[arg(long, value_name = "PATTERN|FILE.sofa", requires = "simulate")]
    pub(crate) directivity: Option<PathBuf>,
    /// Reflections that an image source has at most
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u32).range(0..=50), requires = "simulate")]
    pub(crate) order: u32,
    /// Rays of the late field
    #[arg(long, value_name = "N", default_value_t = 8192, value_parser = clap::value_parser!(u32).range(1..=1 << 28))]
    #[arg(requires = "simulate")]
    pub(crate) rays: u32,
    #[command(flatten)]
    pub(crate) air: AirArgs,
}
