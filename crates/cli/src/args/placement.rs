//! Where a foreign world lies in the scene's: the same options in every command.

use super::values::{parse_direction, parse_metres_per_unit, parse_origin};
use clap::Args;
use promenade_core::glam::Vec3;
use promenade_paths::{Origin, PlacementOptions};
use std::fmt;

#[derive(Debug, Args)]
pub(crate) struct PlacementArgs {
    /// Direction of up in the data's world, an axis such as y, or X,Y,Z [default: as the data state it or their cameras
    /// were held, else 0,0,1]
    #[arg(long, value_name = "AXIS", value_parser = parse_direction, allow_hyphen_values = true)]
    up: Option<Vec3>,
    /// Metres of one unit of the data [default: as the data state it, else 1]
    #[arg(long, alias = "scale", value_name = "M", value_parser = parse_metres_per_unit)]
    metres_per_unit: Option<f64>,
    /// The scene's origin: first or centroid of the poses, where the first looks along x, keep for the data's own, or X,Y,Z in
    /// the data's world [default: as the data state it, first for COLMAP cameras, else keep]
    #[arg(long, value_parser = parse_origin, allow_hyphen_values = true)]
    origin: Option<Origin>,
}

impl PlacementArgs {
    pub(crate) fn options(&self) -> PlacementOptions {
        PlacementOptions { up: self.up, metres_per_unit: self.metres_per_unit, origin: self.origin }
    }
}

/// What was given, as it is written on the command line, each with a space before it.
impl fmt::Display for PlacementArgs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(up) = self.up {
            write!(f, " --up {},{},{}", up.x, up.y, up.z)?;
        }
        if let Some(metres) = self.metres_per_unit {
            write!(f, " --metres-per-unit {metres}")?;
        }
        self.origin.map_or(Ok(()), |origin| write!(f, " --origin {origin}"))
    }
}
