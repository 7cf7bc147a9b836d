//! Plans of meshes.

use super::Mesh;
use glam::DVec3;

impl Mesh {
    /// Where a level plane cuts the mesh: lines between two points `[x, y]`, metres.
    #[must_use]
    pub fn section(&self, height_m: f64) -> Vec<[[f64; 2]; 2]> {
        let cut = |corners: [DVec3; 3]| -> Option<[[f64; 2]; 2]> {
            let crossed = (0..3).filter_map(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                // What lies in the plane counts as above, so that a plane meets two edges of a triangle or none.
                ((a.z >= height_m) != (b.z >= height_m))
                    .then(|| a.lerp(b, (height_m - a.z) / (b.z - a.z)).truncate().to_array())
            });
            let points: Vec<[f64; 2]> = crossed.collect();
            points.try_into().ok()
        };
        self.triangles.iter().filter_map(|t| cut(self.corners(t))).collect()
    }
}
