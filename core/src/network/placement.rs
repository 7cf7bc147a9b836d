//! Where a cloud lies in its scene, and a listener as it sees one.

use crate::Pose;
use glam::{Mat3, Quat, Vec3};

/// From the scene's world (metres, z up) to the world that the cloud was reconstructed in: `x -> scale * (rotation * x) + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Cloud units per metre, above 0.
    pub scale: f32,
    /// Rotation from the scene's axes to the cloud's, unit quaternion.
    pub rotation: Quat,
    /// The scene's origin in the cloud's world, cloud units.
    pub translation: Vec3,
}

impl Alignment {
    /// The cloud's world is the scene's.
    pub const IDENTITY: Self = Self { scale: 1.0, rotation: Quat::IDENTITY, translation: Vec3::ZERO };

    /// A point of the scene's world in the cloud's.
    #[must_use]
    pub fn to_cloud(&self, world: Vec3) -> Vec3 {
        self.scale * (self.rotation * world) + self.translation
    }

    /// A listener of the scene's world in the cloud's, as a camera.
    #[must_use]
    pub fn listener(&self, pose: &Pose) -> Listener {
        // Camera axes in head axes: right is -y, down is -z, forward is x.
        let camera_to_head = Mat3::from_cols(Vec3::NEG_Y, Vec3::NEG_Z, Vec3::X);
        Listener {
            centre: self.to_cloud(pose.position),
            camera_to_world: Mat3::from_quat(self.rotation) * Mat3::from_quat(pose.orientation) * camera_to_head,
        }
    }

    /// A point of the cloud's world in the scene's.
    #[must_use]
    pub fn to_world(&self, cloud: Vec3) -> Vec3 {
        self.rotation.inverse() * (cloud - self.translation) / self.scale
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
        let alignment = Alignment {
            scale: 2.0,
            rotation: Quat::from_rotation_arc(Vec3::Z, Vec3::NEG_Y),
            translation: Vec3::new(1.0, 0.0, 0.0),
        };
        let turned = Pose::from_ypr(Vec3::new(0.0, 0.0, 1.5), 0.4, 0.0, 0.0);
        let listener = alignment.listener(&turned);
        assert!((listener.centre - Vec3::new(1.0, -3.0, 0.0)).length() < 1e-5, "up is -y: {}", listener.centre);
        let [right, down, ahead] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| listener.camera_to_world * axis);
        let world = |head: Vec3| alignment.rotation * (turned.orientation * head);
        assert!((right - world(Vec3::NEG_Y)).length() < 1e-5 && (ahead - world(Vec3::X)).length() < 1e-5);
        assert!((down - Vec3::Y).length() < 1e-5, "a level head's down is the cloud's: {down}");
    }

    #[test]
    fn an_alignment_goes_there_and_back() {
        let a = Alignment { scale: 2.5, rotation: Quat::from_rotation_x(0.7), translation: Vec3::new(1.0, -2.0, 3.0) };
        let p = Vec3::new(0.3, 4.0, -1.0);
        assert!((a.to_world(a.to_cloud(p)) - p).length() < 1e-5);
    }
}
