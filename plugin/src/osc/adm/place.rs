//! Coordinates of ADM-OSC: x to the right, y ahead, z up; azimuth in degrees to the left, elevation up, distance.

use promenade_core::glam::Vec3;

/// Polar to Cartesian coordinates: specification, section 8.
pub(super) fn cartesian([azimuth, elevation, distance]: [f32; 3]) -> Vec3 {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let level = distance * elevation.cos();
    Vec3::new(-level * azimuth.sin(), level * azimuth.cos(), distance * elevation.sin())
}

/// Cartesian to polar coordinates; nothing is ahead of the origin.
pub(super) fn polar(place: Vec3) -> [f32; 3] {
    let distance = place.length();
    if distance == 0.0 {
        return [0.0; 3];
    }
    [(-place.x).atan2(place.y).to_degrees(), (place.z / distance).clamp(-1.0, 1.0).asin().to_degrees(), distance]
}

/// From ahead, left and up to right, ahead and up, and back.
pub(super) fn turned(v: Vec3) -> Vec3 {
    Vec3::new(-v.y, v.x, v.z)
}

pub(super) fn turned_back(v: Vec3) -> Vec3 {
    Vec3::new(v.y, -v.x, v.z)
}
