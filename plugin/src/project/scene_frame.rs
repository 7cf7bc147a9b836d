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
