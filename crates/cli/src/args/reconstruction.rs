//! Which points of a reconstruction are taken, and where it lies in metres: the same options in every command that reads one.

use super::placement::PlacementArgs;
use super::values::{parse_landmark, parse_metres_per_unit, within};
use clap::Args;
use promenade_baker::reconstruction::Landmark;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct ReconstructionArgs {
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// Two places and the metres between them, instead of the metres of a unit: names of images or X,Y,Z in the data's world
    #[arg(long, num_args = 3, value_names = ["A", "B", "METRES"], allow_hyphen_values = true)]
    #[arg(conflicts_with = "metres_per_unit")]
    pub(crate) distance: Option<Vec<String>>,
    /// COLMAP model with the cameras of a .ply or .obj file of the same world
    #[arg(long, value_name = "FOLDER", requires = "source")]
    pub(crate) cameras: Option<PathBuf>,
    /// COLMAP: images that see a point, at least
    #[arg(long, value_name = "IMAGES", default_value_t = 0)]
    pub(crate) min_track: u32,
    /// COLMAP: mean error of a point's projections, pixels, at most
    #[arg(long, value_name = "PX")]
    pub(crate) max_error: Option<f64>,
    /// Splats: opacity, 0 to 1, at least
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = within(0.0_f32, 1.0))]
    pub(crate) min_opacity: f32,
}

impl ReconstructionArgs {
    /// The places and metres of the option distance.
    pub(crate) fn landmarks(&self) -> Result<Option<([Landmark; 2], f64)>, String> {
        match self.distance.as_deref() {
            None => Ok(None),
            Some([from, to, metres]) => Ok(Some(([parse_landmark(from), parse_landmark(to)], parse_metres_per_unit(metres)?))),
            Some(other) => Err(format!("expected two places and the metres between them, found {} values", other.len())),
        }
    }
}
