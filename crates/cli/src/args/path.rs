//! Arguments of `promenade path`.

use super::placement::PlacementArgs;
use super::values::{parse_point, parse_tolerance, within};
use clap::Args;
use promenade_core::glam::Vec3;
use promenade_paths::ImportOptions;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct PathArgs {
    /// Camera path: .json, .csv, a COLMAP model's folder or images.txt or .bin, a NeRF tool's transforms.json, .gltf or .glb, a
    /// sound file with ADM
    pub(crate) input: PathBuf,
    /// Camera path to write, .json or .csv; without it the path is shown in figures
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// COLMAP, transforms.json: images a second, else the times in their names or 1. glTF: steps of the animation a second,
    /// else 60
    #[arg(long, value_parser = within(1e-6_f64, 1e6))]
    pub(crate) fps: Option<f64>,
    #[command(flatten)]
    pub(crate) placement: PlacementArgs,
    /// glTF: name of the animation, camera or node; without it the first animated camera
    #[arg(long, value_name = "NAME")]
    pub(crate) animation: Option<String>,
    /// COLMAP: id of the camera whose images are the path; without it all of them
    #[arg(long, value_name = "ID")]
    pub(crate) camera: Option<u32>,
    /// ADM: name or id of the object whose moves are the path; without it the first
    #[arg(long, value_name = "NAME")]
    pub(crate) object: Option<String>,
    /// ADM: an emitter that stays there, metres; the path is then that of a listener who hears it where the object is
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub(crate) emitter: Option<Vec3>,
    /// Leave out keyframes, as long as the path stays this close to itself
    #[arg(long, value_name = "METRES,DEGREES", value_parser = parse_tolerance)]
    pub(crate) simplify: Option<(f32, f32)>,
}

impl PathArgs {
    pub(crate) fn options(&self) -> ImportOptions {
        ImportOptions {
            fps: self.fps,
            placement: self.placement.options(),
            animation: self.animation.clone(),
            camera: self.camera,
            object: self.object.clone(),
            emitter: self.emitter,
        }
    }
}
