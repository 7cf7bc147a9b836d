//! A learnt scene whose emitter is moved, and the anchors that are shown of it.

use super::{Anchor, AnchorCloud, Scene, SceneError, SceneParts};
use crate::Pose;
use crate::network::{CloudEmitter, CloudModel, HARMONIC};
use glam::Vec3;

/// Two places in the scene closer than this are one, metres.
const SAME_PLACE_M: f32 = 1e-3;

impl Scene {
    /// A scene whose network knows its emitter as one of its anchors, the last, with the emitter in another place, world
    /// metres; `None` of a scene that holds for one emitter only.
    ///
    /// # Errors
    /// A place that is not finite.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    pub fn with_emitter(&self, position: Vec3) -> Result<Option<Self>, SceneError> {
        let Some(cloud) = self.cloud() else { return Ok(None) };
        let parts = cloud.model.parts();
        let (Some(emitter), Some(last)) = (cloud.emitter, parts.anchors.last()) else { return Ok(None) };
        if parts.placement.to_scene(*last).distance(emitter.position) > SAME_PLACE_M {
            return Ok(None);
        }
        let mut parts = parts.clone();
        let moved = parts.placement.listener(&Pose { position, ..Pose::IDENTITY }).centre;
        parts.anchors.pop();
        parts.anchors.push(moved);
        let model = CloudModel::new(parts)?;
        let emitter = Some(CloudEmitter { position, ..emitter });
        let anchors = Anchor::all_of(&model);
        Self::new(SceneParts { anchors, cloud: Some(AnchorCloud { model, emitter, ..cloud.clone() }), ..self.parts().clone() })
            .map(Some)
    }
}

impl Anchor {
    /// A model's anchors in metres, each with the colour of its nearest point.
    ///
    /// # Real-time
    /// Not real-time safe: allocates.
    #[must_use]
    pub fn all_of(model: &CloudModel) -> Vec<Self> {
        let parts = model.parts();
        let colour = |features: &[f32]| match features {
            [r, g, b, ..] => (Vec3::new(*r, *g, *b) * HARMONIC + 0.5).clamp(Vec3::ZERO, Vec3::ONE),
            _ => Vec3::splat(0.5),
        };
        (parts.anchors.iter().zip(parts.features.chunks(model.sizes().features.max(1))))
            .map(|(p, f)| Self { position: parts.placement.to_scene(*p), colour: colour(f) })
            .collect()
    }
}
