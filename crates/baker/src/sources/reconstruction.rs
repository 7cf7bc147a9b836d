//! Points and cameras of a place, from photogrammetry, splats and meshes.

mod colmap;
mod file;
mod mesh;
mod ply;
mod point;

pub use mesh::Surface;
pub use point::Point;
pub use promenade_paths::colmap::Image as Camera;

use crate::BakeError;
use crate::sources::file::ending;
use promenade_core::glam::Vec3;
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use promenade_paths::colmap::Lens;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Points that a reconstruction may have.
pub const MAX_POINTS: usize = 50_000_000;

/// Points and cameras in a world of their own, of any scale and with any axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reconstruction {
    /// Points in the order of the file.
    pub points: Vec<Point>,
    /// Cameras by name; none in a cloud of points. [`Camera::head`] is the pose of each in the reconstruction's world.
    pub cameras: Vec<Camera>,
    /// Numbers of cameras and of the points that they see; none where that is not known.
    pub sights: Vec<[u32; 2]>,
    /// Points that the options have left out.
    pub left_out: usize,
}

/// A place in a reconstruction.
#[derive(Clone, Debug, PartialEq)]
pub enum Landmark {
    /// Where the camera of an image stood: the image's name, or an end of it that no other image has.
    Camera(String),
    /// A point, the reconstruction's units.
    Point(Vec3),
}

/// Which points are good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointOptions {
    /// COLMAP: images that see a point, at least.
    pub min_track: u32,
    /// COLMAP: mean error of its projections, pixels, at most.
    pub max_error_px: f64,
    /// 3D Gaussian splats: opacity, 0 to 1, at least.
    pub min_opacity: f32,
}

impl Default for PointOptions {
    fn default() -> Self {
        Self { min_track: 0, max_error_px: f64::INFINITY, min_opacity: 0.1 }
    }
}

/// What a file of a place's shape holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// Points, with cameras or without.
    Points(Reconstruction),
    /// Triangles.
    Surface(Surface),
}

impl Place {
    /// Reads a COLMAP model (a folder with `points3D.bin` or `.txt` and the images beside it, or one that has them in
    /// `sparse/0` or `sparse`), a `.ply` file (points, 3D Gaussian splats, or a mesh) or a mesh in an `.obj` file.
    ///
    /// # Errors
    /// Files that are missing, too large, damaged or of another kind. The message names the file and the place in it.
    pub fn load(path: &Path, options: &PointOptions) -> Result<Self, BakeError> {
        if path.is_dir() {
            return Reconstruction::load(path, options).map(Self::Points);
        }
        match ending(path).as_str() {
            "ply" => ply::read(path, &file::bytes(path)?, options),
            "obj" => mesh::read_obj(path).map(Self::Surface),
            other => {
                let expected = "a folder with a COLMAP model, or a file ending in .ply or .obj";
                Err(BakeError::content(path, expected, format!("the ending \"{other}\"")))
            }
        }
    }
}

impl Reconstruction {
    /// Reads a COLMAP model from its folder, binary or text, with rigs and frames or without: points and images, which hold the
    /// poses in all of them. Lenses make no difference to either, so the file of cameras is not read.
    ///
    /// # Errors
    /// A folder without a model, files that are damaged, too large or of another kind, a model without a point to use.
    pub fn load(folder: &Path, options: &PointOptions) -> Result<Self, BakeError> {
        let model = colmap::model(folder)?;
        let colmap::Good { points, sights, left_out } = colmap::points(&model.points, &file::bytes(&model.points)?, options)?;
        let cameras = colmap::cameras(&model.images)?;
        let numbers: HashMap<u32, u32> = cameras.iter().map(|camera| camera.id).zip(0..).collect();
        let sights = sights.iter().filter_map(|[image, point]| Some([*numbers.get(image)?, *point])).collect();
        Ok(Self { points, cameras, sights, left_out })
    }

    /// Where the reconstruction lies in the scene's world, which is where a path of its cameras lies with the same options;
    /// what is assumed is added to `notes`.
    ///
    /// # Errors
    /// An option out of range, an origin by cameras where there are none, or cameras that were held in all directions.
    pub fn place(&self, options: &PlacementOptions, notes: &mut Vec<String>) -> Result<Placement, BakeError> {
        promenade_paths::colmap::placement("cameras", &self.cameras, options, notes)
    }

    /// Metres of a unit where two places are known to be `metres` apart.
    ///
    /// # Errors
    /// A landmark that is not there, or both on one spot.
    pub fn metres_per_unit(&self, [from, to]: [&Landmark; 2], metres: f64) -> Result<f64, BakeError> {
        let units = f64::from(self.position(from)?.distance(self.position(to)?));
        if units > 0.0 {
            return Ok(metres / units);
        }
        Err(BakeError::argument("distance", "places that lie apart", format!("{units} units between them")))
    }

    /// Where a landmark is, the reconstruction's units.
    ///
    /// # Errors
    /// A camera's name that no image has, or several.
    pub fn position(&self, landmark: &Landmark) -> Result<Vec3, BakeError> {
        let name = match landmark {
            Landmark::Point(point) => return Ok(*point),
            Landmark::Camera(name) => name,
        };
        let exact = self.cameras.iter().find(|c| c.name == *name);
        let ending: Vec<&Camera> = self.cameras.iter().filter(|c| c.name.ends_with(name.as_str())).collect();
        let camera = exact.or(if let [one] = ending[..] { Some(one) } else { None });
        camera.map(|c| c.centre().as_vec3()).ok_or_else(|| {
            let found = format!("{name:?}, with which {} of {} images end", ending.len(), self.cameras.len());
            BakeError::argument("camera", "the name of one image", found)
        })
    }

    /// Reads the cameras of a COLMAP model alone, for points of the same world in another file.
    ///
    /// # Errors
    /// A folder without a model, or a file of images that is damaged or too large.
    pub fn load_cameras(folder: &Path) -> Result<Vec<Camera>, BakeError> {
        colmap::cameras(&colmap::images(folder)?)
    }

    /// Reads the lenses of a COLMAP model by the ids of their cameras, for photographs.
    ///
    /// # Errors
    /// A folder without a model, a file of cameras that is damaged or too large, lenses of a kind that is not known.
    pub fn load_lenses(folder: &Path) -> Result<BTreeMap<u32, Lens>, BakeError> {
        colmap::lenses(folder)
    }
}

#[cfg(test)]
mod tests;
