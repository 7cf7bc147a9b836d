//! Photographs of a room, and where their reconstruction lies in it.

use super::values::{parse_direction, parse_landmark, parse_metres_per_unit, parse_origin, parse_point};
use clap::Args;
use promenade_baker::reconstruction::Landmark;
use promenade_core::glam::Vec3;
use promenade_paths::{Origin, PlacementOptions};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PictureArgs {
    /// COLMAP model of the room, with --per voxels: surfaces that no sound has met are guessed from those that look alike, by
    /// its points or, better, by --photos
    #[arg(long, value_name = "FOLDER")]
    pub(crate) pictures: Option<PathBuf>,
    /// Photographs of the COLMAP model, under their names there
    #[arg(long, value_name = "FOLDER", requires = "pictures")]
    pub(crate) photos: Option<PathBuf>,
    /// Where a place of the reconstruction is in the room, metres, three times or more, instead of --pictures-up,
    /// --metres-per-unit and --origin: an image's name, which stands for its camera's place, or X,Y,Z in the
    /// reconstruction's world, = and X,Y,Z
    #[arg(long, value_name = "PLACE=X,Y,Z", value_parser = parse_known, requires = "pictures", allow_hyphen_values = true)]
    #[arg(conflicts_with_all = ["pictures_up", "metres_per_unit", "origin", "distance"])]
    pub(crate) landmark: Vec<(Landmark, Vec3)>,
    /// Direction of up in the reconstruction's world, an axis such as -y, or X,Y,Z [default: as its cameras were held]
    #[arg(long, value_name = "AXIS", value_parser = parse_direction, requires = "pictures", allow_hyphen_values = true)]
    pictures_up: Option<Vec3>,
    /// Metres of one unit of the reconstruction [default: 1]
    #[arg(long, value_name = "M", value_parser = parse_metres_per_unit, requires = "pictures")]
    metres_per_unit: Option<f64>,
    /// The room's origin: first or centroid of the cameras, where the first looks along x, keep for the reconstruction's own,
    /// or X,Y,Z in its world [default: first]. A mesh that `surface` made is met by the options that it was made with
    #[arg(long, value_parser = parse_origin, requires = "pictures", allow_hyphen_values = true)]
    origin: Option<Origin>,
    /// Two places and the metres between them, instead of the metres of a unit: names of images or X,Y,Z in the
    /// reconstruction's world
    #[arg(long, num_args = 3, value_names = ["A", "B", "METRES"], requires = "pictures", allow_hyphen_values = true)]
    #[arg(conflicts_with = "metres_per_unit")]
    distance: Option<Vec<String>>,
}

impl PictureArgs {
    pub(crate) fn options(&self) -> PlacementOptions {
        PlacementOptions { up: self.pictures_up, metres_per_unit: self.metres_per_unit, origin: self.origin }
    }

    /// The places and metres of the option distance.
    pub(crate) fn landmarks(&self) -> Result<Option<([Landmark; 2], f64)>, String> {
        match self.distance.as_deref() {
            Some([from, to, metres]) => Ok(Some(([parse_landmark(from), parse_landmark(to)], parse_metres_per_unit(metres)?))),
            _ => Ok(None),
        }
    }
}

fn parse_known(text: &str) -> Result<(Landmark, Vec3), String> {
    let (place, at) = text.rsplit_once('=').ok_or("expected a place of the reconstruction, = and X,Y,Z in the room")?;
    Ok((parse_landmark(place), parse_point(at)?))
}
