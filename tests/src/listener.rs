//! Scenes of a library and where the listener is in them, as a host chooses and a project keeps it.

use crate::Host;
use promenade_core::Scene;
use serde_json::{Value, json};
use std::path::Path;

/// The parameters of a pose: position, metres, and angles, degrees.
pub const POSE: [&str; 6] = ["x", "y", "z", "yaw", "pitch", "roll"];

/// Where a scene's makers let the listener begin: position, metres, and angles, degrees.
///
/// # Panics
/// The file is no scene.
#[must_use]
pub fn start_of(file: &Path) -> [f32; 6] {
    let bytes = std::fs::read(file).expect("the file of a scene can be read");
    let start = Scene::from_bytes(&bytes).expect("it holds a scene").start_pose();
    let (at, (yaw, pitch, roll)) = (start.position, start.ypr());
    [at.x, at.y, at.z, yaw.to_degrees(), pitch.to_degrees(), roll.to_degrees()]
}

/// The pose parameters of an instance, as a project has them: x, y and z in metres, yaw, pitch and roll in degrees.
///
/// # Panics
/// The state lacks a parameter.
pub fn pose_of<H: Host>(host: &mut H) -> [f32; 6] {
    let state = host.state();
    let told: Value = serde_json::from_str(state["fields"]["remote"].as_str().unwrap_or("{}")).expect("fields are JSON");
    let of = |id: &str| told[id].as_f64().or(state["params"][id]["f32"].as_f64()).expect("a state has all parameters");
    POSE.map(|id| of(id) as f32)
}

/// Puts the listener there, as a project does.
///
/// # Panics
/// The plugin does not take the state, or does not start again.
pub fn put<H: Host>(host: &mut H, pose: &[f32; 6]) {
    let mut state = host.state();
    for (id, value) in POSE.into_iter().zip(pose) {
        state["params"][id] = json!({ "f32": value });
    }
    assert!(host.load(&state.to_string().into_bytes()), "the plugin takes a state");
    host.instance().settle().expect("the plugin starts again");
}

/// Chooses a scene of the library as automation does, and lets the plugin read it.
///
/// # Panics
/// The plugin does not start again.
pub fn choose<H: Host>(host: &mut H, slot: u8) {
    host.set("scene", 1.0);
    host.set("slot", f64::from(slot) / 64.0);
    host.instance().settle().expect("the plugin starts again");
}
