//! How much a decoder attends to each anchor of its scene, for whoever looks on.

use promenade_core::Scene;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// What was attended to in one decode.
#[derive(Clone, Debug, Default)]
pub struct Attended {
    /// The scene that was decoded.
    pub scene: Weak<Scene>,
    /// Share of each anchor; they sum to 1.
    pub shares: Vec<f32>,
}

/// From one instance's decoder to its editor. The audio thread has no part in it.
#[derive(Debug, Default)]
pub struct Attention {
    watched: AtomicBool,
    newest: Mutex<Arc<Attended>>,
}

impl Attention {
    /// Whether an editor is open.
    #[must_use]
    pub fn is_watched(&self) -> bool {
        self.watched.load(Ordering::Relaxed)
    }

    /// An editor was opened or closed.
    pub fn watch(&self, watched: bool) {
        self.watched.store(watched, Ordering::Relaxed);
    }

    /// Takes the newest.
    pub fn tell(&self, attended: Attended) {
        *self.newest.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(attended);
    }

    /// What was attended to last in a scene, if it was decoded while someone looked on.
    #[must_use]
    pub fn in_scene(&self, scene: &Arc<Scene>) -> Option<Arc<Attended>> {
        let newest = Arc::clone(&self.newest.lock().unwrap_or_else(PoisonError::into_inner));
        let same = newest.scene.upgrade().is_some_and(|held| Arc::ptr_eq(&held, scene));
        same.then_some(newest)
    }
}
