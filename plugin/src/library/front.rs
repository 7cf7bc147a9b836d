//! The fronts of scenes: what less of each costs and how far it is off, found once for all instances of the process.

use super::kept_fronts::{self, KeptFronts};
use crate::worker::lock::lock;
use crate::worker::{SEARCHER, Task, TaskHandle};
use nice_plug::nice_error;
use promenade_core::{FrontPoint, Scene};
use promenade_judge::JudgeError;
use promenade_judge::trade::{STANDARD_JNDS, front};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::Instant;

/// A search for the front of a scene, which it does not keep in memory.
struct Search {
    scene: Weak<Scene>,
    kept: KeptFronts,
    found: OnceLock<Option<Vec<FrontPoint>>>,
}

/// The searches in this process, as long as the scenes are in memory.
static ALL: Mutex<Vec<(Arc<Search>, TaskHandle)>> = Mutex::new(Vec::new());
/// How many have ended.
static ENDED: AtomicU32 = AtomicU32::new(0);

impl Task for Search {
    fn run(&self) -> Option<Instant> {
        let scene = self.scene.upgrade().filter(|_| self.found.get().is_none())?;
        // This search holds the scene too.
        let wanted = || self.scene.strong_count() > 1;
        let file = self.kept.file(&scene);
        if let Some(kept) = file.as_deref().and_then(kept_fronts::read) {
            return self.end(Some(kept));
        }
        let found = match front(&scene, &STANDARD_JNDS, &wanted) {
            Err(JudgeError::Unwanted) => return None,
            Err(error) => {
                nice_error!("what less of a scene costs cannot be found: {error}");
                None
            }
            Ok(front) => Some(front),
        };
        if let (Some(file), Some(front)) = (&file, &found) {
            kept_fronts::write(file, front);
        }
        self.end(found)
    }
}

impl Search {
    fn end(&self, found: Option<Vec<FrontPoint>>) -> Option<Instant> {
        if self.found.set(found).is_ok() {
            ENDED.fetch_add(1, Ordering::Release);
        }
        None
    }
}

/// The front of a scene, which it carries or which was found; `None` before that, and where there is none.
pub fn known(scene: &Arc<Scene>) -> Option<Vec<FrontPoint>> {
    let own = &scene.parts().front;
    if own.is_empty() { found(scene)? } else { Some(own.clone()) }
}

/// Whether a scene's front is still to be found.
pub fn is_awaited(scene: &Arc<Scene>) -> bool {
    scene.parts().front.is_empty() && found(scene).is_none()
}

/// What a search found, once it has ended.
fn found(scene: &Arc<Scene>) -> Option<Option<Vec<FrontPoint>>> {
    let all = lock(&ALL);
    let (search, _) = all.iter().find(|(search, _)| std::ptr::eq(search.scene.as_ptr(), Arc::as_ptr(scene)))?;
    search.found.get().cloned()
}

/// Finds the front of a scene in the background, unless it is known or being found: in the user's cache, or by a search, which
/// takes seconds.
pub fn search(scene: &Arc<Scene>) {
    search_beside(scene, KeptFronts::of_this_machine());
}

fn search_beside(scene: &Arc<Scene>, kept: KeptFronts) {
    let mut all = lock(&ALL);
    all.retain(|(search, _)| search.scene.strong_count() > 0);
    let is_known = all.iter().any(|(search, _)| std::ptr::eq(search.scene.as_ptr(), Arc::as_ptr(scene)));
    if is_known || !scene.parts().front.is_empty() {
        return;
    }
    let search = Arc::new(Search { scene: Arc::downgrade(scene), kept, found: OnceLock::new() });
    match SEARCHER.add(search.clone()) {
        Ok(task) => {
            task.schedule();
            all.push((search, task));
        }
        Err(error) => nice_error!("no thread to find a scene's settings: {error}"),
    }
}

/// How many searches have ended in this process.
///
/// # Real-time
/// Any thread; no allocation, lock or I/O.
pub fn ended() -> u32 {
    ENDED.load(Ordering::Acquire)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room_with_images;
    use std::time::Duration;

    #[test]
    fn a_front_is_found_once_in_the_background() {
        let folder = tempfile::tempdir().unwrap();
        let kept = KeptFronts::in_folder(folder.path());
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        assert!(is_awaited(&scene) && known(&scene).is_none());
        let before = ended();
        [(); 2].into_iter().for_each(|()| search_beside(&scene, kept.clone()));
        let began = Instant::now();
        while is_awaited(&scene) {
            assert!(began.elapsed() < Duration::from_secs(120), "no front");
            std::thread::sleep(Duration::from_millis(10));
        }
        let front = known(&scene).unwrap();
        assert!(front[0].error.jnds == 0.0 && front.last().unwrap().cost < 1.0, "{front:?}");
        assert_eq!(ended() - before, 1, "found twice");
        // Another process finds what this one did, whatever that is.
        let file = kept.file(&scene).unwrap();
        assert_eq!(kept_fronts::read(&file), Some(front.clone()));
        kept_fronts::write(&file, &front[..1]);
        let again = room_with_images(8_000.0, 0.2, 0.05, 4);
        search_beside(&again, kept);
        while is_awaited(&again) {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(known(&again).as_deref(), Some(&front[..1]));
    }
}
