//! Points of surfaces and their colours.

use promenade_core::glam::Vec3;

/// Colour of a surface without colours: grey, whose features are 0.
pub(super) const GREY: [f32; 3] = [0.5; 3];

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// In the reconstruction's own world, its units.
    pub position: Vec3,
    /// Red, green and blue, 0 to 1.
    pub colour: [f32; 3],
}
