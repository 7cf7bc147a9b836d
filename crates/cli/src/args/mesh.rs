//! How a mesh's file is meant.

use super::values::{parse_direction, within};
use clap::Args;
use promenade_core::glam::Vec3;

/// What `--scale` means.
pub(super) const SCALE: &str =
    "Metres of the mesh's unit [default: 1; a mesh that is no room in metres is refused unless this is given]";
/// What `--up` means.
pub(super) const UP: &str = "Direction of up in the mesh's file: an axis such as y, or X,Y,Z. Places are those of the turned \
mesh: of one with y up x, -z and y of the file, as Blender shows it [default: y for glTF; else z, or y for one that \
seems to lie]";

/// Its unit and its axes.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct MeshArgs {
    #[arg(long, help = SCALE, value_name = "M", value_parser = within(1e-6, 1e6))]
    pub(crate) scale: Option<f64>,
    #[arg(long, help = UP, value_name = "AXIS", value_parser = parse_direction, allow_hyphen_values = true)]
    pub(crate) up: Option<Vec3>,
}
