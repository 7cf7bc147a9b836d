//! The front of a scene, what less of it costs and how far that is off: found once for all instances that play it, on a thread
//! that nothing else waits for.

use crate::worker::lock::lock;
use crate::worker::{SEARCHER, Task, TaskHandle};
use promenade_core::{FrontPoint, Scene};
use promenade_judge::JudgeError;
use promenade_judge::trade::{STANDARD_JNDS, front};
use std::sync::{Arc, Mutex, Weak};
use std::time::Instant;

/// The points of a front, or why there are none.
pub type Front = Result<Vec<FrontPoint>, JudgeError>;

/// What was found in this process, as long as the scenes are in memory.
static FOUND: Mutex<Vec<(Weak<Scene>, Arc<Front>)>> = Mutex::new(Vec::new());

/// The front of a scene, if the scene carries one or it has been found.
pub fn known(scene: &Arc<Scene>) -> Option<Arc<Front>> {
    let own = &scene.parts().front;
    if !own.is_empty() {
        return Some(Arc::new(Ok(own.clone())));
    }
    lock(&FOUND).iter().find(|(of, _)| std::ptr::eq(of.as_ptr(), Arc::as_ptr(scene))).map(|(_, front)| Arc::clone(front))
}

/// Finds the front of the scene that one instance plays.
#[derive(Default)]
pub struct FrontSearch {
    wanted: Arc<Wanted>,
    task: Mutex<Option<TaskHandle>>,
}

/// The scene whose front is wanted, if any.
#[derive(Default)]
struct Wanted(Mutex<Weak<Scene>>);

impl FrontSearch {
    /// The front of a scene if it is known; else the search for it begins, in place of any other.
    ///
    /// # Errors
    /// The system gives no thread to search on.
    pub fn ask(&self, scene: &Arc<Scene>) -> std::io::Result<Option<Arc<Front>>> {
        let known = known(scene);
        *lock(&self.wanted.0) = known.as_ref().map_or_else(|| Arc::downgrade(scene), |_| Weak::new());
        if known.is_none() {
            let mut task = lock(&self.task);
            if task.is_none() {
                *task = Some(SEARCHER.add(self.wanted.clone())?);
            }
            task.iter().for_each(TaskHandle::schedule);
        }
        Ok(known)
    }

    /// Gives up a search.
    pub fn withdraw(&self) {
        *lock(&self.wanted.0) = Weak::new();
    }

    /// Whether a search goes on, and whether it has ended since it was asked for.
    pub fn is_over(&self) -> Option<bool> {
        let scene = lock(&self.wanted.0).upgrade()?;
        Some(known(&scene).is_some())
    }
}

impl Drop for FrontSearch {
    fn drop(&mut self) {
        self.withdraw();
    }
}

impl Task for Wanted {
    fn run(&self) -> Option<Instant> {
        let of = lock(&self.0).clone();
        let scene = of.upgrade().filter(|scene| known(scene).is_none())?;
        // Another scene meanwhile has scheduled the task again.
        let found = front(&scene, STANDARD_JNDS[0], &|| Weak::ptr_eq(&lock(&self.0), &of));
        if found != Err(JudgeError::Unwanted) {
            let mut all = lock(&FOUND);
            all.retain(|(of, _)| of.strong_count() > 0);
            all.push((of, Arc::new(found)));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room_with_images;
    use std::time::Duration;

    #[test]
    fn a_front_is_found_once_and_for_all_and_a_search_is_given_up() {
        let scene = room_with_images(8_000.0, 0.2, 0.05, 4);
        let [one, other] = [FrontSearch::default(), FrontSearch::default()];
        assert!(one.ask(&scene).unwrap().is_none() && other.ask(&scene).unwrap().is_none());
        let began = Instant::now();
        while other.is_over() == Some(false) {
            assert!(began.elapsed() < Duration::from_secs(100), "no front is found");
            std::thread::sleep(Duration::from_millis(10));
        }
        let [a, b] = [&one, &other].map(|search| search.ask(&scene).unwrap().expect("it is known"));
        assert!(Arc::ptr_eq(&a, &b) && a.as_ref().as_ref().is_ok_and(|points| points.len() > 1), "{a:?}");
        assert_eq!((one.is_over(), other.is_over()), (None, None), "what is known is not searched for");
        let another = room_with_images(8_000.0, 0.2, 0.05, 5);
        assert!(one.ask(&another).unwrap().is_none());
        assert_eq!(one.is_over(), Some(false));
        one.withdraw();
        assert!(one.is_over().is_none());
    }
}
