//! What is made once and shared as long as anybody holds it.

use crate::worker::lock::lock;
use promenade_core::Scene;
use std::sync::{Arc, Mutex, Weak};

/// Values by their keys, in the whole process.
pub(crate) struct Shared<K, V>(Mutex<Vec<(K, Weak<V>)>>);

/// Names what is made of a scene; it does not keep the scene in memory.
pub(crate) struct OfScene(Weak<Scene>);

impl From<&Arc<Scene>> for OfScene {
    fn from(scene: &Arc<Scene>) -> Self {
        Self(Arc::downgrade(scene))
    }
}

impl PartialEq for OfScene {
    fn eq(&self, other: &Self) -> bool {
        Weak::ptr_eq(&self.0, &other.0)
    }
}

impl<K: PartialEq, V> Shared<K, V> {
    pub(crate) const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The value of a key, if anybody holds it.
    pub(crate) fn get(&self, key: &K) -> Option<Arc<V>> {
        find(&lock(&self.0), key)
    }

    /// The value of a key, made where nobody holds it. Of two that are made at once the first is shared.
    pub(crate) fn of<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        if let Some(found) = self.get(&key) {
            return Ok(found);
        }
        let made = Arc::new(make()?);
        let mut held = lock(&self.0);
        held.retain(|(_, held)| held.strong_count() > 0);
        Ok(find(&held, &key).unwrap_or_else(|| {
            held.push((key, Arc::downgrade(&made)));
            made
        }))
    }
}

fn find<K: PartialEq, V>(held: &[(K, Weak<V>)], key: &K) -> Option<Arc<V>> {
    held.iter().find(|(of, _)| of == key).and_then(|(_, held)| held.upgrade())
}
