//! Scenes in memory, one copy per content in the whole process.

use crate::lock::lock;
use promenade_core::{Scene, SceneError};
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, Weak};

/// BLAKE3 of a scene file, 64 lower-case hexadecimal digits.
pub type ContentHash = String;

static SCENES: LazyLock<Mutex<HashMap<ContentHash, Weak<Scene>>>> = LazyLock::new(Mutex::default);

/// The name of a scene file by its content.
#[must_use]
pub fn content_hash(bytes: &[u8]) -> ContentHash {
    blake3::hash(bytes).to_hex().to_string()
}

/// The scene of that content, if any instance in this process holds it.
#[must_use]
pub fn in_memory(hash: &str) -> Option<Arc<Scene>> {
    lock(&SCENES).get(hash).and_then(Weak::upgrade)
}

/// The scene in `bytes`, shared with every instance that plays the same content.
///
/// # Errors
/// The bytes are no scene.
pub fn scene_from(bytes: &[u8]) -> Result<(Arc<Scene>, ContentHash), SceneError> {
    let hash = content_hash(bytes);
    if let Some(scene) = in_memory(&hash) {
        return Ok((scene, hash));
    }
    let scene = Arc::new(Scene::from_bytes(bytes)?);
    let mut scenes = lock(&SCENES);
    scenes.retain(|_, held| held.strong_count() > 0);
    scenes.insert(hash.clone(), Arc::downgrade(&scene));
    Ok((scene, hash))
}

/// Lets tests that care about what is in memory run one at a time.
#[cfg(test)]
pub(crate) fn alone() -> std::sync::MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    lock(&ALONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::factory;

    #[test]
    fn the_same_content_is_one_scene_and_goes_with_its_last_user() {
        let _alone = alone();
        let (first, hash) = scene_from(factory::ROOM_B.bytes).unwrap();
        let (second, _) = scene_from(factory::ROOM_B.bytes).unwrap();
        assert!(Arc::ptr_eq(&first, &second));
        drop((first, second));
        assert!(in_memory(&hash).is_none());
        assert!(scene_from(b"not a scene").is_err());
    }
}
