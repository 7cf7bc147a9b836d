//! The shape of a room.

mod enclose;
mod file;
mod flatten;
mod floor;
mod free_space;
mod gltf;
mod names;
mod nets;
mod obj;
mod ply;
mod ply_file;
mod polygon;
mod read;
mod report;
mod section;
mod simplify;
mod stl;
mod upright;
mod welded;

pub use enclose::FoundBox;
pub use flatten::Flattened;
pub use floor::Floor;
pub use free_space::Sights;
pub use ply_file::{Ply, PlyError, PlyLimits};
pub use report::MeshReport;

use crate::error::{AcousticsError, place};
use crate::materials::material::Material;
use glam::DVec3;
use std::collections::HashMap;

/// Triangles and vertices of a mesh at most; a room of so many takes some 0.5 GB.
pub(crate) const MAX_TRIANGLES: usize = 2_000_000;
pub(crate) const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;
/// Farthest coordinate that a room has, metres.
const FARTHEST_M: f64 = 1e6;

/// Triangles in groups of one material each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners, metres.
    pub vertices: Vec<[f64; 3]>,
    /// Either side of a triangle reflects.
    pub triangles: Vec<Triangle>,
    /// Names of the groups, which are those of their materials in a file that has them.
    pub groups: Vec<String>,
}

/// A flat piece of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Numbers of its vertices.
    pub corners: [u32; 3],
    /// Number of its group.
    pub group: u32,
}

impl Mesh {
    /// What a reader says where [`Self::within_limits`] does not hold.
    const EXPECTED: &str = "a mesh of at most 2000000 triangles and 6000000 vertices (simplify it, or leave out what repeats)";

    /// # Errors
    /// Says how many triangles and vertices there are if they are too many.
    fn within_limits(&self) -> Result<(), String> {
        self.within_limits_with(0, 0)
    }

    /// Whether it stays within the limits with so many triangles and vertices more; says how many there are if not.
    fn within_limits_with(&self, triangles: usize, vertices: usize) -> Result<(), String> {
        let (triangles, vertices) = (self.triangles.len() + triangles, self.vertices.len() + vertices);
        let fits = triangles <= MAX_TRIANGLES && vertices <= MAX_VERTICES;
        if fits { Ok(()) } else { Err(format!("{triangles} triangles and {vertices} vertices, or more")) }
    }

    /// Makes groups of the same material one, with the name of the first. Returns the materials of the groups that are left.
    pub fn merge_groups(&mut self, materials: Vec<Material>) -> Vec<Material> {
        let mut found: HashMap<Vec<u32>, u32> = HashMap::new();
        let (mut kept, mut names, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for (material, name) in materials.into_iter().zip(std::mem::take(&mut self.groups)) {
            let shares = material.absorption.iter().chain(&material.scattering).map(|share| share.to_bits());
            // Of no share, all bits.
            let shares = shares.chain([material.absorption_63.map_or(u32::MAX, f32::to_bits)]);
            let fine = material.fine.iter().flat_map(|curve| curve.points().iter().flatten().map(|v| v.to_bits()).chain([0]));
            numbers.push(*found.entry(shares.chain(fine).collect()).or_insert_with(|| {
                kept.push(material);
                names.push(name);
                kept.len() as u32 - 1
            }));
        }
        self.triangles.iter_mut().for_each(|t| t.group = numbers[t.group as usize]);
        self.groups = names;
        kept
    }

    /// # Errors
    /// A vertex that is farther away than any room or not finite. Its unit is the metre.
    pub(crate) fn check_metres(&self) -> Result<(), AcousticsError> {
        match self.vertices.iter().enumerate().find(|(_, v)| v.iter().any(|c| c.abs().total_cmp(&FARTHEST_M).is_gt())) {
            Some((i, v)) => {
                let expected = format!("coordinates within {} km", FARTHEST_M / 1000.0);
                Err(AcousticsError::argument(format!("vertex {i}"), expected, format!("{v:?} m")))
            }
            None => self.check(),
        }
    }

    /// # Errors
    /// A vertex that is not finite, a triangle with a corner or a group that is not there.
    pub(crate) fn check(&self) -> Result<(), AcousticsError> {
        for (i, v) in self.vertices.iter().enumerate() {
            place(&format!("vertex {i}"), *v)?;
        }
        for (i, t) in self.triangles.iter().enumerate() {
            if t.corners.iter().any(|c| *c as usize >= self.vertices.len()) {
                let expected = format!("corners among {} vertices", self.vertices.len());
                return Err(AcousticsError::argument(format!("triangle {i}"), expected, format!("{:?}", t.corners)));
            }
            if t.group as usize >= self.groups.len() {
                let expected = format!("a group among {}", self.groups.len());
                return Err(AcousticsError::argument(format!("triangle {i}"), expected, t.group));
            }
        }
        Ok(())
    }

    /// The number of the group of this name, a new one if there is none.
    fn group(&mut self, name: &str) -> u32 {
        let found = self.groups.iter().position(|g| g == name);
        found.unwrap_or_else(|| {
            self.groups.push(name.to_owned());
            self.groups.len() - 1
        }) as u32
    }

    /// Adds a convex polygon.
    fn fan(&mut self, corners: &[u32], group: u32) {
        let [first, rest @ ..] = corners else { return };
        self.triangles.extend(rest.windows(2).map(|pair| Triangle { corners: [*first, pair[0], pair[1]], group }));
    }

    /// Scales all coordinates, for a mesh whose unit is not the metre.
    pub fn scale(&mut self, metres_per_unit: f64) {
        self.vertices.iter_mut().flatten().for_each(|c| *c *= metres_per_unit);
    }

    /// Gives triangles the groups `floor`, `ceiling` and `wall` by where they look, z up: what lies within 45 degrees of level
    /// is floor in the lower half of the room and ceiling in the upper. For meshes that do not name their materials.
    pub fn group_by_direction(&mut self) {
        let [low, high] = self.bounds();
        let middle = 0.5 * (low[2] + high[2]);
        let mut triangles = std::mem::take(&mut self.triangles);
        self.groups.clear();
        for t in &mut triangles {
            let [a, b, c] = self.corners(t);
            let level = (b - a).cross(c - a).normalize_or_zero().z.abs() > std::f64::consts::FRAC_1_SQRT_2;
            t.group = self.group(match (level, (a.z + b.z + c.z) / 3.0 < middle) {
                (false, _) => "wall",
                (true, true) => "floor",
                (true, false) => "ceiling",
            });
        }
        self.triangles = triangles;
    }

    pub(crate) fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.corners.map(|c| self.vertices[c as usize].into())
    }

    /// Least and greatest coordinates; both zero without vertices.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let all = || self.vertices.iter().map(|v| DVec3::from_array(*v));
        let Some(first) = all().next() else { return [[0.0; 3]; 2] };
        [all().fold(first, DVec3::min).to_array(), all().fold(first, DVec3::max).to_array()]
    }
}

/// The normal of a triangle; none of one whose height is below a millionth of its longest side.
pub(crate) fn normal(a: DVec3, b: DVec3, c: DVec3) -> Option<DVec3> {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let cross = (b - a).cross(c - a);
    (cross.length() > 1e-6 * longest).then(|| cross.normalize()).filter(|n| n.is_finite())
}
