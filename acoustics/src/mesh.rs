//! The shape of a room.

mod enclose;
mod file;
mod gltf;
mod obj;
mod ply;
mod read;
mod report;
mod section;
mod stl;

pub use enclose::FoundBox;
pub use report::MeshReport;

use crate::error::AcousticsError;
use crate::error::place;
use glam::DVec3;

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
