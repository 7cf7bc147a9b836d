//! Marks in a queue of tasks that another thread works off in order: when a mark has come back, so has everything before it.

use crate::worker::lock::lock;
use std::sync::{Condvar, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// A mark is not waited for longer.
const LONGEST: Duration = Duration::from_secs(2);
/// A full queue takes no mark: one that is late is put in again after this time.
const AGAIN: Duration = Duration::from_millis(20);

/// Puts a mark into the queue, which hands it to [`Marks::come_back`].
type Post = Box<dyn Fn(u64) + Send + Sync>;

/// The marks of a queue.
#[derive(Default)]
pub(crate) struct Marks {
    post: OnceLock<Post>,
    sent: Mutex<Sent>,
    /// The last that has come back.
    back: Mutex<u64>,
    comes: Condvar,
}

#[derive(Default)]
struct Sent {
    last: u64,
    /// Whether one has not come back in time: the next ones are not waited for.
    lost: bool,
}

impl Marks {
    /// How a mark is put into the queue, once.
    pub(crate) fn post_by(&self, post: impl Fn(u64) + Send + Sync + 'static) {
        let _first = self.post.set(Box::new(post));
    }

    /// Takes a mark from the queue. The queue's own thread.
    pub(crate) fn come_back(&self, mark: u64) {
        let mut back = lock(&self.back);
        *back = mark.max(*back);
        self.comes.notify_all();
    }

    /// Waits until everything is done that is in the queue now; says whether it is. Not the queue's own thread.
    pub(crate) fn pass(&self) -> bool {
        let Some(post) = self.post.get() else { return false };
        let mut sent = lock(&self.sent);
        let until = Instant::now() + if sent.lost { AGAIN } else { LONGEST };
        let first = sent.last + 1;
        loop {
            sent.last += 1;
            post(sent.last);
            let waits = |back: &mut u64| *back < first;
            let (back, _) =
                self.comes.wait_timeout_while(lock(&self.back), AGAIN, waits).unwrap_or_else(|error| error.into_inner());
            let came = *back >= first;
            drop(back);
            sent.lost = !came;
            if came || Instant::now() >= until {
                return came;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::mpsc::{SyncSender, sync_channel};
    use std::thread;

    /// A queue of so many places that takes its time, and its marks.
    fn queue(places: usize, slowness: Duration) -> (Arc<Marks>, SyncSender<Option<u64>>) {
        let marks = Arc::new(Marks::default());
        let (sender, receiver) = sync_channel::<Option<u64>>(places);
        let (theirs, posts) = (Arc::clone(&marks), sender.clone());
        marks.post_by(move |mark| drop(posts.try_send(Some(mark))));
        thread::spawn(move || {
            while let Ok(task) = receiver.recv() {
                match task {
                    Some(mark) => theirs.come_back(mark),
                    None => thread::sleep(slowness),
                }
            }
        });
        (marks, sender)
    }

    #[test]
    fn a_mark_comes_after_what_was_before_it_also_through_a_full_queue() {
        for places in [1, 3, 100] {
            let slowness = Duration::from_millis(30);
            let (marks, tasks) = queue(places, slowness);
            let began = Instant::now();
            (0..3).for_each(|_| tasks.send(None).unwrap());
            assert!(marks.pass());
            assert!(began.elapsed() >= 3 * slowness, "{places} places");
        }
    }

    #[test]
    fn a_queue_that_has_ended_is_waited_for_once() {
        let marks = Marks::default();
        assert!(!marks.pass(), "there is no queue");
        marks.post_by(|_| ());
        let began = Instant::now();
        assert!(!marks.pass());
        assert!(began.elapsed() >= LONGEST);
        let began = Instant::now();
        assert!((0..5).all(|_| !marks.pass()));
        assert!(began.elapsed() < LONGEST);
    }
}
