//! Scenes in memory, one copy per content and head in the whole process.

use crate::library::drawn_room::DrawnRoom;
use crate::library::factory::{self, FactoryScene};
use crate::worker::lock::lock;
use crate::worker::shared::{OfScene, Shared};
use promenade_core::{Carriers, Head, Latency, NoHeadError, NotAmbisonicError, RenderError, Scene, SceneError, Setting};
use promenade_fault::Fault;
use promenade_room::SceneHead;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, Weak};

/// BLAKE3 of a scene file, 64 lower-case hexadecimal digits.
pub type ContentHash = String;

static SCENES: Shared<ContentHash, Scene> = Shared::new();

/// The name of a scene file by its content.
pub fn content_hash(bytes: &[u8]) -> ContentHash {
    blake3::hash(bytes).to_hex().to_string()
}

/// The scene of that content, if any instance in this process holds it.
pub fn in_memory(hash: &str) -> Option<Arc<Scene>> {
    SCENES.get(&hash.to_owned())
}

/// The scene in `bytes`, shared with every instance that plays the same content.
///
/// # Errors
/// The bytes are no scene.
pub fn scene_from(bytes: &[u8]) -> Result<(Arc<Scene>, ContentHash), SceneError> {
    let hash = content_hash(bytes);
    let scene = SCENES.of(hash.clone(), || Scene::from_bytes(bytes))?;
    Ok((scene, hash))
}

/// Sets of carriers that are kept without an instance that plays them: a host may activate each new instance at another rate
/// first.
const KEPT_CARRIERS: usize = 2;

/// Carriers of a scene at a rate, for a latency.
static CARRIERS: Shared<(OfScene, u64, Latency), Carriers> = Shared::new();
/// The newest sets, as long as their scenes are in memory.
static NEWEST: Mutex<VecDeque<(Weak<Scene>, Arc<Carriers>)>> = Mutex::new(VecDeque::new());

/// The carriers of a scene at a sample rate for a latency, drawn once for all instances that play it so.
///
/// # Errors
/// A sample rate at which no scene is played, or a scene that would cost too much there: [`Scene::playable_at`].
pub fn carriers(scene: &Arc<Scene>, sample_rate_hz: f64, latency: Latency) -> Result<Arc<Carriers>, RenderError> {
    let mut is_new = false;
    let carriers = CARRIERS.of((scene.into(), sample_rate_hz.to_bits(), latency), || {
        scene.playable_at(sample_rate_hz)?;
        is_new = true;
        Ok::<_, RenderError>(Carriers::with_latency(scene, sample_rate_hz, latency))
    })?;
    let mut newest = lock(&NEWEST);
    newest.retain(|(of, _)| of.strong_count() > 0);
    if is_new {
        newest.push_back((Arc::downgrade(scene), Arc::clone(&carriers)));
    }
    if newest.len() > KEPT_CARRIERS {
        newest.pop_front();
    }
    Ok(carriers)
}

/// Scenes heard with other heads than their own, by the contents of scene and head.
static HEARD: Shared<[ContentHash; 2], Scene> = Shared::new();

/// The scene of a content heard with another head, shared with every instance that plays the same.
///
/// # Errors
/// A scene in which no other head can take the place of its own.
pub fn heard_with(scene: &Scene, hash: &str, head: &Head) -> Result<Arc<Scene>, NoHeadError> {
    HEARD.of([hash.to_owned(), content_hash(&head.to_bytes())], || scene.with_head(head))
}

/// Scenes of settings.
static NEAR: Shared<(OfScene, Setting), Scene> = Shared::new();

/// The scene that holds what a setting plays of one, shared with every instance that plays the same; `None` where it has none.
pub fn with_setting(scene: &Arc<Scene>, setting: Setting) -> Option<Arc<Scene>> {
    NEAR.of((scene.into(), setting), || scene.with_setting(setting).ok_or(())).ok()
}

/// Pairs of Ambisonic channels, by the scene that they were made of.
static AMBISONIC: Shared<(OfScene, usize), Scene> = Shared::new();

/// A pair of a scene's Ambisonic channels, shared with every instance that plays the same.
///
/// # Errors
/// A scene without an Ambisonic form.
///
/// # Panics
/// There are fewer pairs than that.
pub fn ambisonic(scene: &Arc<Scene>, pair: usize) -> Result<Arc<Scene>, NotAmbisonicError> {
    AMBISONIC.of((scene.into(), pair), || scene.ambisonic_pair(pair))
}

/// Heads that rooms are heard with, the newest last; empty contents for the factory's.
static SCENE_HEADS: Mutex<VecDeque<(ContentHash, Arc<SceneHead>)>> = Mutex::new(VecDeque::new());
/// As many are kept.
const KEPT_SCENE_HEADS: usize = 2;
/// Scenes of rooms by the contents of room and head.
static ROOMS: Shared<[ContentHash; 2], Scene> = Shared::new();

/// A scene that is built in, and its content.
///
/// # Errors
/// It is damaged.
pub fn factory_scene(scene: FactoryScene) -> Result<(Arc<Scene>, ContentHash), Fault> {
    scene_from(scene.bytes).map_err(|error| Fault::because(format!("factory scene {}", scene.id), error))
}

/// The scene of a drawn room heard with a head, or with the factory's, shared with every instance that plays the same.
///
/// # Errors
/// A length, an emitter or a material that no room can have.
pub fn drawn(room: &DrawnRoom, head: Option<&Head>) -> Result<Arc<Scene>, Fault> {
    let head_hash = head.map_or_else(ContentHash::new, |head| content_hash(&head.to_bytes()));
    let contents = [content_hash(format!("{room:?}").as_bytes()), head_hash.clone()];
    ROOMS.of(contents, || room.scene(&*scene_head(head, head_hash)?).map_err(|error| Fault::because("the drawn room", error)))
}

fn scene_head(head: Option<&Head>, hash: ContentHash) -> Result<Arc<SceneHead>, Fault> {
    let mut held = lock(&SCENE_HEADS);
    if let Some((_, scene_head)) = held.iter().find(|(of, _)| *of == hash) {
        return Ok(Arc::clone(scene_head));
    }
    let named = format!("factory scene {}", factory::STUDIO.id);
    let studio = Scene::from_bytes(factory::STUDIO.bytes).map_err(|error| Fault::because(&*named, error))?;
    let studio = match head {
        Some(head) => studio.with_head(head).map_err(Fault::of)?,
        None => studio,
    };
    let scene_head = SceneHead::of_scene(&studio);
    let scene_head = Arc::new(scene_head.ok_or_else(|| Fault::argument(named, "image sources with a head", "none"))?);
    held.push_back((hash, Arc::clone(&scene_head)));
    if held.len() > KEPT_SCENE_HEADS {
        held.pop_front();
    }
    Ok(scene_head)
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

    #[test]
    fn the_same_room_is_one_scene_and_another_head_is_heard() {
        let _alone = alone();
        let room = DrawnRoom::default();
        let [first, second] = [(); 2].map(|()| drawn(&room, None).unwrap());
        assert!(Arc::ptr_eq(&first, &second));
        assert_eq!(first.emitter().map(|at| at.to_array()), Some(room.emitter));
        let wrong = DrawnRoom { size: [1e9; 3], ..room };
        let error = promenade_fault::with_causes(&drawn(&wrong, None).unwrap_err());
        assert!(error.contains("size of the room: expected three lengths of 0.5 to 200 m"), "{error}");
    }

    #[test]
    fn the_same_content_is_one_scene_and_goes_with_its_last_user() {
        let _alone = alone();
        let (first, hash) = scene_from(factory::ROOM_B.bytes).unwrap();
        let (second, _) = scene_from(factory::ROOM_B.bytes).unwrap();
        assert!(Arc::ptr_eq(&first, &second));
        let at = |rate| carriers(&first, rate, Latency::Frame).unwrap();
        let [one, another, faster] = [48_000.0, 48_000.0, 96_000.0].map(at);
        assert!(Arc::ptr_eq(&one, &another) && !Arc::ptr_eq(&one, &faster), "one set of carriers a rate");
        let sooner = carriers(&first, 48_000.0, Latency::None).unwrap();
        assert_eq!((one.latency(), sooner.latency()), (Latency::Frame, Latency::None));
        drop(sooner);
        let kept = Arc::downgrade(&faster);
        drop(faster);
        assert!(kept.upgrade().is_some_and(|kept| Arc::ptr_eq(&kept, &at(96_000.0))), "kept for a while");
        drop((first, second));
        assert!(in_memory(&hash).is_none());
        assert!(scene_from(b"not a scene").is_err());
    }
}
