//! Where listeners walk while scenes are compared: the same for all of them, so that nothing of it tells which is heard.

use crate::definition::Item;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::{Pose, Scene};
use promenade_fault::Fault;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;

/// A scene of one place is heard this far around it, metres.
const AROUND: f32 = 3.0;
/// What is narrower is one place, metres.
const NARROW: f32 = 0.1;
/// Emitters that are no farther apart are one, metres.
const ONE_EMITTER: f32 = 0.5;

/// What the plan of an item shows.
pub(crate) struct Place {
    pub(crate) start: Pose,
    low: Vec3,
    high: Vec3,
    emitter: Option<Vec3>,
}

impl Place {
    /// As the page takes it, metres and a quaternion x, y, z, w.
    pub(crate) fn page(&self) -> Value {
        json!({
            "start": { "position": self.start.position.to_array(), "quaternion": self.start.orientation.to_array() },
            "bounds": [self.low.to_array(), self.high.to_array()],
            "emitter": self.emitter.map(|emitter| emitter.to_array()),
        })
    }
}

/// What all scenes of an item have in common. Listeners begin where the item says, or where the first scene begins, which is
/// the reference where there is one.
pub(crate) fn common(item: &Item, scenes: &[Arc<Scene>], paths: &[PathBuf]) -> Result<Place, Fault> {
    let (mut low, mut high) = (Vec3::NEG_INFINITY, Vec3::INFINITY);
    for (scene, path) in scenes.iter().zip(paths) {
        let ((from, to), start) = (scene.bounds(), scene.start_pose().position);
        let around = if (to - from).truncate().length() > NARROW { 0.0 } else { AROUND };
        (low, high) = (low.max(from.min(start) - around), high.min(to.max(start) + around));
        if low.x > high.x || low.y > high.y {
            let found = format!("none in {}", path.display());
            return Err(Fault::unexpected(format!("scenes of item {:?} with places in common", item.name), found));
        }
    }
    let mut start = scenes[0].start_pose();
    if let Some([x, y, z, degrees]) = item.start {
        start = Pose { position: Vec3::new(x, y, z), orientation: Quat::from_rotation_z(degrees.to_radians()) };
        if x < low.x || x > high.x || y < low.y || y > high.y {
            let expected =
                format!("item {:?} to start within x {} to {} and y {} to {}", item.name, low.x, high.x, low.y, high.y);
            return Err(Fault::unexpected(expected, format!("{x}, {y}")));
        }
    }
    let (x, y) = (start.position.x.clamp(low.x, high.x), start.position.y.clamp(low.y, high.y));
    start.position = Vec3::new(x, y, start.position.z);
    (low.z, high.z) = (start.position.z, start.position.z);
    let emitter = scenes[0].emitter();
    let one = |scene: &Arc<Scene>| emitter.zip(scene.emitter()).is_some_and(|(a, b)| a.distance(b) <= ONE_EMITTER);
    // The plan shows a sound where all scenes have it.
    Ok(Place { start, low, high, emitter: emitter.filter(|_| scenes.iter().all(one)) })
}
