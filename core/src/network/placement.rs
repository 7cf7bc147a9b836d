//! Where a foreign world lies in the scene's, and a listener as a cloud sees one.

use crate::Pose;
use glam::{Mat3, Quat, Vec3};

/// Where a foreign world lies in the scene's (metres, z up): that of an anchor cloud, a reconstruction, a capture or a camera
/// path.
///
/// A point `x` of the scene's world is `units_per_metre * (rotation * x) + origin` in the foreign one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Foreign units per metre, above 0.
    pub units_per_metre: f32,
    /// Rotation from the scene's axes to the foreign ones, unit quaternion.
    pub rotation: Quat,
    /// The scene's origin in the foreign world, its units.
    pub origin: Vec3,
}

impl Placement {
    /// The foreign world is the scene's.
    pub const IDENTITY: Self = Self { units_per_metre: 1.0, rotation: Quat::IDENTITY, origin: Vec3::ZERO };

    /// Whether all of it is finite, the scale above 0 and the rotation a unit quaternion.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let Self { units_per_metre, rotation, origin } = self;
        units_per_metre.is_finite() && *units_per_metre > 0.0 && (rotation.length() - 1.0).abs() <= 1e-3 && origin.is_finite()
    }

    /// A point of the scene's world in the foreign one.
    #[must_use]
    pub fn to_foreign(&self, scene: Vec3) -> Vec3 {
        self.units_per_metre * (self.rotation * scene) + self.origin
    }

    /// A point of the foreign world in the scene's.
    #[must_use]
    pub fn to_scene(&self, foreign: Vec3) -> Vec3 {
        self.rotation.inverse() * (foreign - self.origin) / self.units_per_metre
    }

    /// A head of the foreign world in the scene's.
    #[must_use]
    pub fn pose(&self, foreign: &Pose) -> Pose {
        Pose {
            position: self.to_scene(foreign.position),
            orientation: (self.rotation.inverse() * foreign.orientation).normalize(),
        }
    }

    /// A listener of the scene's world in the foreign one, as a camera.
    #[must_use]
    pub fn listener(&self, pose: &Pose) -> Listener {
        // Camera axes in head axes: right is -y, down is -z, forward is x.
        let camera_to_head = Mat3::from_cols(Vec3::NEG_Y, Vec3::NEG_Z, Vec3::X);
        Listener {
            centre: self.to_foreign(pose.position),
            camera_to_world: Mat3::from_quat(self.rotation) * Mat3::from_quat(pose.orientation) * camera_to_head,
        }
    }
}

/// A listener as the model sees one: a camera in the cloud's world, x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listener {
    /// Camera centre, cloud units.
    pub centre: Vec3,
    /// Rotation from camera axes to world axes.
    pub camera_to_world: Mat3,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listener_is_a_camera_that_looks_where_the_head_does() {
        // A cloud as it comes from a camera that stood level: y down, z ahead, two units a metre.
        let placement = Placement {
            units_per_metre: 2.0,
            rotation: Quat::from_rotation_arc(Vec3::Z, Vec3::NEG_Y),
            origin: Vec3::new(1.0, 0.0, 0.0),
        };
        let turned = Pose::from_ypr(Vec3::new(0.0, 0.0, 1.5), 0.4, 0.0, 0.0);
        let listener = placement.listener(&turned);
        assert!((listener.centre - Vec3::new(1.0, -3.0, 0.0)).length() < 1e-5, "up is -y: {}", listener.centre);
        let [right, down, ahead] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| listener.camera_to_world * axis);
        let world = |head: Vec3| placement.rotation * (turned.orientation * head);
        assert!((right - world(Vec3::NEG_Y)).length() < 1e-5 && (ahead - world(Vec3::X)).length() < 1e-5);
        assert!((down - Vec3::Y).length() < 1e-5, "a level head's down is the cloud's: {down}");
    }

    #[test]
    fn a_placement_goes_there_and_back() {
        let origin = Vec3::new(1.0, -2.0, 3.0);
        let placement = Placement { units_per_metre: 2.5, rotation: Quat::from_rotation_x(0.7), origin };
        let point = Vec3::new(0.3, 4.0, -1.0);
        assert!((placement.to_scene(placement.to_foreign(point)) - point).length() < 1e-5);
    }
}
