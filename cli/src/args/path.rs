//! Arguments of `promenade path`.

use super::values::{parse_direction, parse_fps, parse_metres_per_unit, parse_origin, parse_tolerance};
use clap::Args;
use promenade_core::glam::Vec3;
use promenade_paths::{ImportOptions, Origin};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PathArgs {
    /// Camera path: .json, .csv, a COLMAP model's folder or images.txt or .bin, .gltf or .glb
    pub(crate) input: PathBuf,
    /// Camera path to write, .json or .csv; without it the path is shown in figures
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// COLMAP: images a second, else the times in their names or 1. glTF: steps of the animation a second, else 60
    #[arg(long, value_parser = parse_fps)]
    pub(crate) fps: Option<f64>,
    /// Metres of one unit [default: 1]
    #[arg(long, value_name = "M_PER_UNIT", value_parser = parse_metres_per_unit)]
    pub(crate) scale: Option<f64>,
    /// COLMAP: direction of up in the reconstruction's world; without it as the cameras were held
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true)]
    pub(crate) up: Option<Vec3>,
    /// The world's origin: first or centroid, where the first pose looks along x, or keep [default: first for COLMAP, else keep]
    #[arg(long, value_parser = parse_origin)]
    pub(crate) origin: Option<Origin>,
    /// glTF: name of the animation, camera or node; without it the first animated camera
    #[arg(long, value_name = "NAME")]
    pub(crate) animation: Option<String>,
    /// COLMAP: id of the camera whose images are the path; without it all of them
    #[arg(long, value_name = "ID")]
    pub(crate) camera: Option<u32>,
    /// Leave out keyframes, as long as the path stays this close to itself
    #[arg(long, value_name = "METRES,DEGREES", value_parser = parse_tolerance)]
    pub(crate) simplify: Option<(f32, f32)>,
}

impl PathArgs {
    pub(crate) fn options(&self) -> ImportOptions {
        ImportOptions {
            fps: self.fps,
            scale: self.scale,
            up: self.up,
            origin: self.origin,
            animation: self.animation.clone(),
            camera: self.camera,
        }
    }
}
