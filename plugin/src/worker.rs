//! Background threads that all instances in a process share: one loads files, one decodes poses, one looks up host names.
//!
//! The framework has such a thread too, but that one ends, and takes the host with it, when an instance goes while a task of it waits.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread::{self, JoinHandle, Thread};

/// What an instance has done on a background thread when it calls.
pub trait Chore: Send + Sync {
    /// Does it. Calls that come meanwhile are one more.
    fn serve(&self);
}

/// A background thread; it ends when the last instance lets go of it, and is waited for, so that the host can unload the library.
pub struct Worker {
    shared: Arc<Shared>,
    join: Option<JoinHandle<()>>,
    waited_for: bool,
}

#[derive(Default)]
struct Shared {
    clients: Mutex<Vec<Weak<Client>>>,
    ends: AtomicBool,
}

/// The place in a process of one kind of background thread.
pub struct Post {
    name: &'static str,
    running: Mutex<Weak<Worker>>,
    /// Whether the last instance waits for the thread's end.
    waited_for: bool,
}

impl Post {
    const fn new(name: &'static str) -> Self {
        Self { name, running: Mutex::new(Weak::new()), waited_for: true }
    }

    /// Of a thread that may be kept up for long: no instance waits for its end where the library stays in memory (`build.rs`).
    const fn left_behind(name: &'static str) -> Self {
        let waited_for = cfg!(not(any(target_os = "linux", target_os = "macos")));
        Self { name, running: Mutex::new(Weak::new()), waited_for }
    }
}

/// Loads scenes and camera paths.
pub static LOADER: Post = Post::new("promenade-loader");
/// Decodes poses; apart from the loader, so that no decode waits for a file.
pub static DECODER: Post = Post::new("promenade-decoder");
/// Looks up host names; apart from the others, because it may wait for a network.
pub static RESOLVER: Post = Post::left_behind("promenade-resolver");
/// Reads what an editor lists; apart from the loader, so that no scene waits for a list.
pub static LISTER: Post = Post::new("promenade-lister");

/// An instance's place at a worker. It keeps the worker running.
pub struct Desk {
    client: Arc<Client>,
    thread: Thread,
    // Last, so that the client is gone before the worker may be joined.
    _worker: Arc<Worker>,
}

struct Client {
    chore: Arc<dyn Chore>,
    calls: AtomicBool,
}

impl Desk {
    /// A place for an instance, with the thread started if there is none.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn new(post: &'static Post, chore: Arc<dyn Chore>) -> std::io::Result<Self> {
        let mut running = post.running.lock().unwrap_or_else(PoisonError::into_inner);
        let worker = match running.upgrade() {
            Some(worker) => worker,
            None => {
                let worker = Arc::new(Worker::start(post)?);
                *running = Arc::downgrade(&worker);
                worker
            }
        };
        let client = Arc::new(Client { chore, calls: AtomicBool::new(false) });
        let mut clients = worker.shared.clients.lock().unwrap_or_else(PoisonError::into_inner);
        clients.retain(|client| client.strong_count() > 0);
        clients.push(Arc::downgrade(&client));
        drop(clients);
        let thread = worker.join.as_ref().map_or_else(thread::current, |join| join.thread().clone());
        Ok(Self { client, thread, _worker: worker })
    }

    /// Asks for [`Chore::serve`] on the worker.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. Wakes a thread.
    pub fn call(&self) {
        self.client.calls.store(true, Ordering::Release);
        self.thread.unpark();
    }
}

impl Worker {
    fn start(post: &Post) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let join = thread::Builder::new().name(post.name.to_owned()).spawn(move || work(&of_thread))?;
        Ok(Self { shared, join: Some(join), waited_for: post.waited_for })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(join) = self.join.take() {
            join.thread().unpark();
            if self.waited_for {
                // A panic of the worker has been reported where it happened.
                drop(join.join());
            }
        }
    }
}

fn work(shared: &Shared) {
    while !shared.ends.load(Ordering::Acquire) {
        let clients = shared.clients.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for client in clients.iter().filter_map(Weak::upgrade) {
            if client.calls.swap(false, Ordering::AcqRel) {
                client.chore.serve();
            }
        }
        thread::park();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loader::{Loader, Stage};
    use crate::params::PromenadeParams;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::time::{Duration, Instant};

    #[test]
    fn a_call_loads_what_is_wanted() {
        let _alone = crate::cache::alone();
        let loader = Loader::new(Arc::new(PromenadeParams::default()));
        let desk = Desk::new(&LOADER, loader.clone()).unwrap();
        loader.activate(48_000.0);
        assert!(matches!(loader.stages.pop(), Some(Stage::Scene(_))));
        loader.activate(48_000.0);
        assert!(loader.stages.pop().is_none(), "activating again loads again");
        loader.forget();
        desk.call();
        let started = Instant::now();
        while loader.stages.is_empty() && started.elapsed() < Duration::from_secs(10) {
            thread::yield_now();
        }
        assert!(matches!(loader.stages.pop(), Some(Stage::Scene(_))));
    }

    /// Says that it has begun, and goes on until it is told to end.
    struct Endless(Sender<()>, Mutex<Receiver<()>>);

    impl Chore for Endless {
        fn serve(&self) {
            self.0.send(()).unwrap();
            let _ended = self.1.lock().unwrap().recv();
        }
    }

    #[test]
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    fn an_instance_goes_while_a_name_is_looked_up() {
        static POST: Post = Post::left_behind("promenade-test");
        let (begins, begun) = channel();
        let (ends, ended) = channel();
        let desk = Desk::new(&POST, Arc::new(Endless(begins, Mutex::new(ended)))).unwrap();
        desk.call();
        let patience = Duration::from_secs(20);
        begun.recv_timeout(patience).expect("the chore is served");
        let (gone, went) = channel();
        thread::spawn(move || {
            drop(desk);
            gone.send(()).unwrap();
        });
        went.recv_timeout(patience).expect("the instance waits for the chore");
        drop(ends);
    }

    #[test]
    fn instances_come_and_go_with_calls_still_waiting() {
        for _ in 0..50 {
            let desks = [0, 1, 2].map(|_| Desk::new(&LOADER, Loader::new(Arc::new(PromenadeParams::default()))).unwrap());
            for desk in &desks {
                desk.call();
            }
        }
    }
}
