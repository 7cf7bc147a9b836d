//! Coordinates of ADM-OSC: x to the right, y ahead, z up; azimuth in degrees to the left, elevation up, distance.

use crate::project::scene_frame::{from_polar, to_polar};
use promenade_core::glam::Vec3;

/// Polar to Cartesian coordinates: specification, section 8.
pub(super) fn cartesian(aed: [f32; 3]) -> Vec3 {
    turned(from_polar(aed))
}

/// Cartesian to polar coordinates; nothing is ahead of the origin.
pub(super) fn polar(place: Vec3) -> [f32; 3] {
    to_polar(turned_back(place))
}

/// From ahead, left and up to right, ahead and up, and back.
pub(super) fn turned(v: Vec3) -> Vec3 {
    Vec3::new(-v.y, v.x, v.z)
}

pub(super) fn turned_back(v: Vec3) -> Vec3 {
    Vec3::new(v.y, -v.x, v.z)
}
