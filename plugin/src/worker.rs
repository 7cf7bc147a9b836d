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

/// A background thread; it is joined when the last instance lets go of it, so that the host can unload the library.
pub struct Worker {
    shared: Arc<Shared>,
    join: Option<JoinHandle<()>>,
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
}

/// Loads scenes and camera paths.
pub static LOADER: Post = Post { name: "promenade-loader", running: Mutex::new(Weak::new()) };
/// Decodes poses; apart from the loader, so that no decode waits for a file.
pub static DECODER: Post = Post { name: "promenade-decoder", running: Mutex::new(Weak::new()) };
/// Looks up host names; apart from the others, because it may wait for a network.
pub static RESOLVER: Post = Post { name: "promenade-resolver", running: Mutex::new(Weak::new()) };
/// Reads what an editor lists; apart from the loader, so that no scene waits for a list.
pub static LISTER: Post = Post { name: "promenade-lister", running: Mutex::new(Weak::new()) };

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
                let worker = Arc::new(Worker::start(post.name)?);
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
    fn start(name: &str) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let join = thread::Builder::new().name(name.to_owned()).spawn(move || work(&of_thread))?;
        Ok(Self { shared, join: Some(join) })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(join) = self.join.take() {
            join.thread().unpark();
            // A panic of the worker has been reported where it happened.
            drop(join.join());
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
