//! What a page shows of a scene.

use promenade_core::Scene;
use serde_json::{Value, json};

/// The scene in words and numbers, metres, quaternions as x, y, z, w.
pub(crate) fn description(scene: &Scene) -> Value {
    let provenance = scene.provenance();
    let start = scene.start_pose();
    let (low, high) = scene.bounds();
    json!({
        "title": provenance.title,
        "credit": provenance.credit,
        "licence": provenance.licence,
        "notes": provenance.notes,
        "start": { "position": start.position.to_array(), "quaternion": start.orientation.to_array() },
        "bounds": [low.to_array(), high.to_array()],
        "emitter": scene.emitter().map(|e| e.to_array()),
        "sample_rate_hz": scene.grid().sample_rate_hz,
        "anchors": scene.anchors().len(),
        "images": scene.images().map_or(0, |images| images.images.len()),
        "head": scene.measured_head().map(|head| head.name.clone()),
        "live": scene.cloud().is_some(),
    })
}

/// Anchors, `[anchor][x, y, z, red, green, blue]`, metres and shares of 1.
pub(crate) fn anchors(scene: &Scene) -> Vec<f32> {
    scene.anchors().iter().flat_map(|a| [a.position.to_array(), a.colour.to_array()]).flatten().collect()
}

/// Image sources, `[image][x, y, z, gain at 1 kHz]`.
pub(crate) fn images(scene: &Scene) -> Vec<f32> {
    let Some(images) = scene.images() else { return Vec::new() };
    images.images.iter().flat_map(|i| [i.position.x, i.position.y, i.position.z, i.gains[3]]).collect()
}
