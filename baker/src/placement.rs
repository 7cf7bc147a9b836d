//! Where the world of foreign data comes to lie in Promenade's: metres, z up.

use promenade_core::Pose;
use promenade_core::glam::{Mat3, Quat, Vec3};
use promenade_core::network::Alignment;

/// How far the columns of a rotation may be from unit length and right angles.
const ROTATION_SLACK: f32 = 0.02;

/// What is not in the data. The same values for an imported cloud and a capture of one reconstruction put both into one world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Direction of up in the data's world; of any length but 0.
    pub up: Vec3,
    /// Metres of one unit of the data, above 0.
    pub metres_per_unit: f32,
    /// Point of the data's world that becomes the origin, its own units.
    pub origin: Vec3,
}

impl Placement {
    /// Metres with z up.
    pub const IDENTITY: Self = Self { up: Vec3::Z, metres_per_unit: 1.0, origin: Vec3::ZERO };

    /// The same as scenes with a cloud have it.
    #[must_use]
    pub fn alignment(&self) -> Alignment {
        Alignment {
            scale: self.metres_per_unit.recip(),
            rotation: Quat::from_rotation_arc(Vec3::Z, self.up.try_normalize().unwrap_or(Vec3::Z)).normalize(),
            translation: self.origin,
        }
    }

    /// A head that looks where a camera does, from the camera's centre and its axes in the data's world: x right, y down, z forward
    /// as columns. `None` where they are no rotation.
    pub(crate) fn head(&self, centre: Vec3, camera_to_world: Mat3) -> Option<Pose> {
        let product = camera_to_world.transpose() * camera_to_world;
        let off = (product - Mat3::IDENTITY).to_cols_array().into_iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        if !(off <= ROTATION_SLACK && camera_to_world.determinant() > 0.0 && centre.is_finite()) {
            return None;
        }
        let alignment = self.alignment();
        let [right, down, ahead] = [camera_to_world.x_axis, camera_to_world.y_axis, camera_to_world.z_axis];
        let axes = Quat::from_mat3(&Mat3::from_cols(ahead, -right, -down)).normalize();
        Some(Pose { position: alignment.to_world(centre), orientation: (alignment.rotation.inverse() * axes).normalize() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_becomes_the_head_that_becomes_the_camera() {
        let placement = Placement { up: Vec3::new(0.1, -2.0, 0.3), metres_per_unit: 0.5, origin: Vec3::new(1.0, 2.0, 3.0) };
        let camera = Mat3::from_quat(Quat::from_rotation_y(0.7) * Quat::from_rotation_x(0.2));
        let centre = Vec3::new(-1.0, 0.5, 4.0);
        let head = placement.head(centre, camera).unwrap();
        let back = placement.alignment().listener(&head);
        assert!(
            (back.centre - centre).length() < 1e-5
                && (back.camera_to_world - camera).to_cols_array().iter().all(|v| v.abs() < 1e-5)
        );
        assert!(placement.head(centre, 1.1 * camera).is_none() && placement.head(centre, -camera).is_none());
        assert!(placement.head(Vec3::NAN, camera).is_none() && placement.head(centre, Mat3::ZERO).is_none());
    }
}
