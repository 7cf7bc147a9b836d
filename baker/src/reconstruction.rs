//! Points and cameras of a place: what photogrammetry, splats and meshes say of it.

use promenade_core::glam::Vec3;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// In the reconstruction's own world, its units.
    pub position: Vec3,
    /// Red, green and blue, 0 to 1.
    pub colour: [f32; 3],
}
