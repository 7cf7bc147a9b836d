//! What is given with the bytes of a path's file.

use crate::error;
use crate::{Format, PathFileError, PlacementOptions};
use glam::Vec3;
use std::io;

/// Reads a file beside the one that is read, by the name that is written there.
pub type Beside<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// What a file does not state. `None` everywhere is a sensible choice; the notes say what was assumed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportOptions {
    /// KITTI: rows a second, 10 without it. COLMAP and NeRF tools: images a second, 1 without it, unless their names are times
    /// of day. glTF: samples of the animation a second, 60 without it. Above 0.
    pub fps: Option<f64>,
    /// Where the file's world lies in the scene's; up is for poses of cameras, the others have z or y up.
    pub placement: PlacementOptions,
    /// glTF: name of an animation, a camera or a node; without it the first animated camera, else the first animated node.
    pub animation: Option<String>,
    /// COLMAP: id of the camera whose images are the path; without it all of them.
    pub camera: Option<u32>,
    /// ADM: name or id of an object; without it the first that moves, else the first.
    pub object: Option<String>,
    /// ADM: an emitter that stays, metres; the path is then that of a listener who hears it where the object is. Without it the
    /// path is the object's own.
    pub emitter: Option<Vec3>,
}

/// No file lies beside the one that is read.
///
/// # Errors
/// Always.
pub fn alone(_: &str) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::NotFound, "only the file itself is here"))
}

impl ImportOptions {
    /// Refuses an option that is out of range or without effect.
    pub(crate) fn check(&self, format: Format) -> Result<(), PathFileError> {
        if let Some(fps) = self.fps.filter(|v| !(1e-6..=1e6).contains(v)) {
            return Err(error::option("fps", "a number from 0.000001 to 1000000", fps.to_string()));
        }
        let colmap = format.is_colmap();
        let gltf = format == Format::Gltf;
        let cameras = format.is_of_cameras();
        for (option, given, fits, what) in [
            ("fps", self.fps.is_some(), cameras || gltf, "poses of cameras, or a glTF animation"),
            ("up", self.placement.up.is_some(), cameras, "poses of cameras"),
            ("camera", self.camera.is_some(), colmap, "COLMAP cameras"),
            ("animation", self.animation.is_some(), gltf, "a glTF animation"),
            ("object", self.object.is_some(), format == Format::Adm, "an object of an ADM file"),
            ("emitter", self.emitter.is_some(), format == Format::Adm, "an object of an ADM file"),
        ] {
            if given && !fits {
                return Err(error::option(option, what, format!("a path in {}", format.name())));
            }
        }
        Ok(())
    }
}
