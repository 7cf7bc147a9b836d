//! Directions as azimuth, elevation and distance.

use promenade_core::glam::Vec3;
use serde::Deserialize;

/// A side of the head.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Counter-clockwise from above, the usual direction of azimuths (AES69).
    #[default]
    Left,
    /// Clockwise from above.
    Right,
}

/// A point from azimuth and elevation in degrees and distance in metres: azimuth from x towards y where it is positive to the
/// left, elevation positive towards z (AES69-2022, spherical coordinates).
#[must_use]
pub fn to_cartesian(azimuth_deg: f32, elevation_deg: f32, distance_m: f32, positive: Side) -> Vec3 {
    let (sin_azimuth, cos_azimuth) = azimuth_deg.to_radians().sin_cos();
    let (sin_elevation, cos_elevation) = elevation_deg.to_radians().sin_cos();
    let side = if positive == Side::Left { 1.0 } else { -1.0 };
    distance_m * Vec3::new(cos_azimuth * cos_elevation, side * sin_azimuth * cos_elevation, sin_elevation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_is_y_and_up_is_z() {
        assert!((to_cartesian(90.0, 0.0, 2.0, Side::Left) - Vec3::new(0.0, 2.0, 0.0)).length() < 1e-6);
        assert!((to_cartesian(90.0, 0.0, 2.0, Side::Right) - Vec3::new(0.0, -2.0, 0.0)).length() < 1e-6);
        assert!((to_cartesian(30.0, 90.0, 1.0, Side::Right) - Vec3::Z).length() < 1e-6);
    }
}
