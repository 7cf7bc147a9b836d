//! Where a scene's listener begins and its emitter is, for worlds that are told relative to them.

use promenade_core::Scene;
use promenade_core::glam::{Quat, Vec3};

/// Places in a scene's world, metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneFrame {
    /// Where the listener begins.
    pub origin: Vec3,
    /// Which way it faces then, to the left of x.
    pub yaw: f32,
    /// Where the emitter is while it is not moved.
    pub emitter: Vec3,
}

/// Ahead, left and up of an azimuth, positive to the left, an elevation, degrees, and a distance.
pub fn from_polar([azimuth, elevation, distance]: [f32; 3]) -> Vec3 {
    let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    distance * Vec3::new(cos_e * cos_a, cos_e * sin_a, sin_e)
}

/// The other way; nothing is straight ahead of itself.
pub fn to_polar(ahead: Vec3) -> [f32; 3] {
    let (azimuth, elevation) = (ahead.y.atan2(ahead.x), ahead.z.atan2(ahead.truncate().length()));
    [azimuth.to_degrees(), elevation.to_degrees(), ahead.length()]
}

impl SceneFrame {
    /// That of a scene; its emitter is where the listener begins if the scene does not say.
    pub fn of(scene: &Scene) -> Self {
        let start = scene.start_pose();
        let origin = start.position;
        Self { origin, yaw: start.ypr().0, emitter: scene.emitter().unwrap_or(origin) }
    }

    /// From axes ahead, left and up of where the listener begins to the world's.
    pub fn to_world(&self, ahead: Vec3) -> Vec3 {
        self.origin + Quat::from_rotation_z(self.yaw) * ahead
    }

    /// The other way.
    pub fn from_world(&self, world: Vec3) -> Vec3 {
        Quat::from_rotation_z(-self.yaw) * (world - self.origin)
    }
}
