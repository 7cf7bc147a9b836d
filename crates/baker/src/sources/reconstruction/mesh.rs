//! Surfaces of triangles, and points spread over them.

use super::point::{GREY, Point};
use super::{MAX_POINTS, file};
use crate::BakeError;
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    pub(super) position: Vec3,
    pub(super) colour: [f32; 3],
}

/// Triangles with a colour at each corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    triangles: Vec<[Corner; 3]>,
    /// Area of all triangles up to each.
    areas: Vec<f64>,
}

/// Points for each square of a voxel's edge, on average: few voxels on a surface stay empty.
const POINTS_PER_SQUARE: f64 = 12.0;
/// Points of the smallest and the largest sample, whatever area a file claims.
const SAMPLED: std::ops::RangeInclusive<f64> = 1e3..=2e6;

impl Surface {
    pub(super) fn new(triangles: Vec<[Corner; 3]>) -> Self {
        let mut sum = 0.0;
        let areas = triangles
            .iter()
            .map(|[a, b, c]| {
                sum += 0.5 * f64::from((b.position - a.position).cross(c.position - a.position).length());
                sum
            })
            .collect();
        Self { triangles, areas }
    }

    /// Triangles.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Area of all triangles, square units.
    #[must_use]
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// Points as dense as voxels of an edge need them, in the surface's units.
    ///
    /// # Errors
    /// Those of [`Self::sample`], and an area that takes more than 2,000,000 points.
    pub fn sample_voxels(&self, edge: f64, seed: u64) -> Result<Vec<Point>, BakeError> {
        let count = (self.area() / edge.powi(2) * POINTS_PER_SQUARE).max(*SAMPLED.start());
        if count > *SAMPLED.end() {
            let expected =
                format!("an area that takes at most {} points (larger voxels, or fewer metres per unit)", SAMPLED.end());
            let found = format!("{count:.3e} points for {:.3e} square units in voxels of {edge} units", self.area());
            return Err(BakeError::argument("surface", expected, found));
        }
        self.sample(count as usize, seed)
    }

    /// Points spread evenly over the area with the colours between the corners. The same each time for one seed.
    ///
    /// # Errors
    /// A surface without a finite area above 0, or more than [`MAX_POINTS`].
    pub fn sample(&self, count: usize, seed: u64) -> Result<Vec<Point>, BakeError> {
        let area = self.area();
        if !(area.is_finite() && area > 0.0) || count > MAX_POINTS {
            let expected = format!("an area above 0 and at most {MAX_POINTS} points");
            return Err(BakeError::argument("surface", expected, format!("{area} and {count}")));
        }
        let mut random = Random::new(seed);
        let sample = |i: usize| {
            // One in each of as many equal shares of the area.
            let at = (i as f64 + f64::from(random.uniform())) / count as f64 * area;
            let index = self.areas.partition_point(|a| *a <= at).min(self.triangles.len() - 1);
            let [a, b, c] = &self.triangles[index];
            let (root, v) = (random.uniform().sqrt(), random.uniform());
            let weights = [1.0 - root, root * (1.0 - v), root * v];
            let mix = |x: f32, y: f32, z: f32| weights[0] * x + weights[1] * y + weights[2] * z;
            Point {
                position: weights[0] * a.position + weights[1] * b.position + weights[2] * c.position,
                colour: std::array::from_fn(|i| mix(a.colour[i], b.colour[i], c.colour[i])),
            }
        };
        Ok((0..count).map(sample).collect())
    }
}

/// An OBJ file, its materials beside it; colours are those of the vertices, else the material's diffuse one, else grey.
pub(super) fn read_obj(path: &Path) -> Result<Surface, BakeError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let materials = |name: &Path| match file::bytes(&folder.join(name)) {
        Ok(bytes) => tobj::load_mtl_buf(&mut Cursor::new(bytes)),
        Err(_) => Err(tobj::LoadError::OpenFileFailed),
    };
    let mut bytes = Cursor::new(file::bytes(path)?);
    // The crate multiplies numbers of vertices before it looks at them, which ends a build that checks sums.
    let read = AssertUnwindSafe(|| tobj::load_obj_buf(&mut bytes, &options, materials));
    let (models, materials) = catch_unwind(read)
        .unwrap_or(Err(tobj::LoadError::FaceVertexOutOfBounds))
        .map_err(|e| BakeError::unreadable(path, "OBJ file", e))?;
    // Without its materials a surface is grey where its vertices have no colours.
    let materials = materials.unwrap_or_default();
    let mut triangles = Vec::new();
    for model in &models {
        let mesh = &model.mesh;
        let wrong = |found: String| {
            BakeError::entry(path, format!("mesh {:?}", model.name), "triangles of finite vertices, colours 0 to 1", found)
        };
        let diffuse = mesh.material_id.and_then(|m| materials.get(m)).and_then(|m| m.diffuse).unwrap_or(GREY);
        let positions = mesh.positions.as_chunks::<3>().0;
        let colours = mesh.vertex_color.as_chunks::<3>().0;
        for corners in mesh.indices.as_chunks::<3>().0 {
            let corner = |index: u32| {
                let position = positions.get(index as usize).copied().map(Vec3::from_array);
                let colour = colours.get(index as usize).copied().unwrap_or(diffuse);
                let good = |p: &Vec3| p.is_finite() && colour.iter().all(|c| (0.0..=1.0).contains(c));
                let found = || wrong(format!("vertex {index} at {position:?} of colour {colour:?}"));
                position.filter(good).map(|position| Corner { position, colour }).ok_or_else(found)
            };
            triangles.push([corner(corners[0])?, corner(corners[1])?, corner(corners[2])?]);
        }
    }
    if triangles.is_empty() {
        return Err(BakeError::content(path, "a mesh with triangles", "none"));
    }
    Ok(Surface::new(triangles))
}
