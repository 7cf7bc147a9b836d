//! How much a decoder attends to each anchor of its scene, for an open editor.

use crate::worker::{flag::Flag, lock::lock};
use promenade_core::Scene;
use std::sync::{Arc, Mutex, Weak};

/// The attention of one decode over the scene's anchors.
#[derive(Clone, Debug, Default)]
pub struct AttentionWeights {
    /// The scene that was decoded.
    pub scene: Weak<Scene>,
    /// Weight of each anchor; they sum to 1.
    pub weights: Vec<f32>,
}

/// The newest attention weights on their way from an instance's decoder to its editor. The audio thread does not touch it.
#[derive(Debug, Default)]
pub struct Attention {
    /// Whether an editor is open.
    pub watched: Flag,
    newest: Mutex<Arc<AttentionWeights>>,
}

impl Attention {
    /// Replaces the newest weights.
    pub fn publish(&self, weights: AttentionWeights) {
        *lock(&self.newest) = Arc::new(weights);
    }

    /// The newest weights of a scene, if it was decoded while an editor was open.
    pub fn in_scene(&self, scene: &Arc<Scene>) -> Option<Arc<AttentionWeights>> {
        let newest = Arc::clone(&lock(&self.newest));
        let same = newest.scene.upgrade().is_some_and(|held| Arc::ptr_eq(&held, scene));
        same.then_some(newest)
    }
}
