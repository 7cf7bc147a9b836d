//! Background threads that all instances in a process share: each loads files, decodes poses, looks up host names, sends poses
//! or lists files.
//!
//! The framework has such a thread too, but that one ends when an instance goes while a task of it waits ([`marks`]).

pub mod flag;
pub(crate) mod lock;
pub(crate) mod marks;
pub mod repaint;
pub(crate) mod shared;

use crate::worker::lock::lock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::thread::{self, JoinHandle, Thread};
use std::time::Instant;

/// What an instance has a worker do.
pub trait Task: Send + Sync {
    /// Does it once, on the worker's thread. However often it was scheduled meanwhile, it runs once more. Returns when it is to
    /// run again without being scheduled, if ever.
    fn run(&self) -> Option<Instant>;
}

/// A kind of background thread: at most one runs in the process, while any instance has a task for it.
pub struct Worker {
    name: &'static str,
    running: Mutex<Weak<Running>>,
    /// Whether the last instance waits for the thread's end.
    joined: bool,
}

/// Loads scenes and camera paths.
pub static LOADER: Worker = Worker::new("promenade-loader");
/// Decodes poses; apart from the loader, so that no decode waits for a file.
pub static DECODER: Worker = Worker::new("promenade-decoder");
/// Looks up host names; apart from the others, because it may wait for a network.
pub static RESOLVER: Worker = Worker::detached("promenade-resolver");
/// Sends poses over Open Sound Control.
pub static SENDER: Worker = Worker::new("promenade-osc-out");
/// Reads what an editor lists; apart from the loader, so that no scene waits for a list.
pub static LISTER: Worker = Worker::new("promenade-lister");

/// Finds the response of what is heard for an editor.
pub static RESPONDER: Worker = Worker::detached("promenade-response");
/// Finds a room's reverberation for an editor; apart from the responder, because it takes longer.
pub static JUDGE: Worker = Worker::detached("promenade-judge");
/// Finds what less of a scene costs; apart from the loader, so that no scene waits for it.
pub static SEARCHER: Worker = Worker::detached("promenade-front");
/// Measures a scene over its plan for an editor.
pub static MAPPER: Worker = Worker::detached("promenade-map");
/// Shares the budget of processor time out among all instances.
pub static ALLOCATOR: Worker = Worker::new("promenade-budget");
/// Measures loudness for an editor.
pub static METER: Worker = Worker::new("promenade-meter");

impl Worker {
    const fn new(name: &'static str) -> Self {
        Self { name, running: Mutex::new(Weak::new()), joined: true }
    }

    /// A thread that may be blocked for long: no instance waits for its end where the library stays in memory (`build.rs`).
    const fn detached(name: &'static str) -> Self {
        let joined = cfg!(not(any(target_os = "linux", target_os = "macos")));
        Self { name, running: Mutex::new(Weak::new()), joined }
    }

    /// Adds a task, and starts the thread if it does not run.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn add(&'static self, task: Arc<dyn Task>) -> std::io::Result<TaskHandle> {
        let mut running = lock(&self.running);
        let worker = match running.upgrade() {
            Some(worker) => worker,
            None => {
                let worker = Arc::new(Running::start(self)?);
                *running = Arc::downgrade(&worker);
                worker
            }
        };
        let entry = Arc::new(Entry { task, scheduled: AtomicBool::new(false), due: Mutex::new(None) });
        let mut entries = lock(&worker.shared.entries);
        entries.retain(|entry| entry.strong_count() > 0);
        entries.push(Arc::downgrade(&entry));
        drop(entries);
        let thread = worker.join.as_ref().map_or_else(thread::current, |join| join.thread().clone());
        Ok(TaskHandle { entry, thread, _worker: worker })
    }
}

/// An instance's task at a worker. It keeps the worker running.
pub struct TaskHandle {
    entry: Arc<Entry>,
    thread: Thread,
    // Last, so that the entry is gone before the worker may be joined.
    _worker: Arc<Running>,
}

impl TaskHandle {
    /// Has the worker run the task.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. Wakes a thread.
    pub fn schedule(&self) {
        self.entry.scheduled.store(true, Ordering::Release);
        self.thread.unpark();
    }
}

struct Entry {
    task: Arc<dyn Task>,
    scheduled: AtomicBool,
    due: Mutex<Option<Instant>>,
}

impl Entry {
    /// Runs the task if it is scheduled or due. Returns when it is due next, if ever.
    fn run(&self) -> Option<Instant> {
        let mut due = lock(&self.due);
        if self.scheduled.swap(false, Ordering::AcqRel) || due.is_some_and(|due| due <= Instant::now()) {
            *due = self.task.run();
        }
        *due
    }
}

/// A thread that runs. It ends when the last handle is dropped, and is joined, so that the host can unload the library.
struct Running {
    shared: Arc<Shared>,
    join: Option<JoinHandle<()>>,
    joined: bool,
}

#[derive(Default)]
struct Shared {
    entries: Mutex<Vec<Weak<Entry>>>,
    ends: AtomicBool,
}

impl Running {
    fn start(worker: &Worker) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let join = thread::Builder::new().name(worker.name.to_owned()).spawn(move || of_thread.work())?;
        Ok(Self { shared, join: Some(join), joined: worker.joined })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        if let Some(join) = self.join.take() {
            join.thread().unpark();
            if self.joined {
                // A panic of the worker has been reported where it happened.
                drop(join.join());
            }
        }
    }
}

impl Shared {
    fn work(&self) {
        while !self.ends.load(Ordering::Acquire) {
            let entries = lock(&self.entries).clone();
            match entries.iter().filter_map(Weak::upgrade).filter_map(|entry| entry.run()).min() {
                Some(due) => thread::park_timeout(due.saturating_duration_since(Instant::now())),
                None => thread::park(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::playing::loader::{Loader, Prepared};
    use crate::playing::output::Output;
    use crate::project::params::PromenadeParams;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::time::Duration;

    #[test]
    fn a_scheduled_load_loads_what_is_wanted() {
        let _alone = crate::library::cache::alone();
        let loader = Loader::new(Arc::new(PromenadeParams::default()));
        let task = LOADER.add(loader.clone()).unwrap();
        loader.activate(48_000.0, Output::Binaural);
        assert!(matches!(loader.scenes.pop(), Some(Prepared::Scene(_))));
        loader.activate(48_000.0, Output::Binaural);
        assert!(loader.scenes.pop().is_none(), "activating again loads again");
        loader.forget();
        task.schedule();
        let started = Instant::now();
        while loader.scenes.is_empty() && started.elapsed() < Duration::from_secs(10) {
            thread::yield_now();
        }
        assert!(matches!(loader.scenes.pop(), Some(Prepared::Scene(_))));
    }

    /// Reports that it has begun, and goes on until it is made to end.
    struct Endless(Sender<()>, Mutex<Receiver<()>>);

    impl Task for Endless {
        fn run(&self) -> Option<Instant> {
            self.0.send(()).unwrap();
            let _ended = self.1.lock().unwrap().recv();
            None
        }
    }

    #[test]
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    fn an_instance_goes_while_a_name_is_looked_up() {
        static WORKER: Worker = Worker::detached("promenade-test");
        let (begins, begun) = channel();
        let (ends, ended) = channel();
        let task = WORKER.add(Arc::new(Endless(begins, Mutex::new(ended)))).unwrap();
        task.schedule();
        let patience = Duration::from_secs(20);
        begun.recv_timeout(patience).expect("the task runs");
        let (gone, went) = channel();
        thread::spawn(move || {
            drop(task);
            gone.send(()).unwrap();
        });
        went.recv_timeout(patience).expect("the instance waits for the task");
        drop(ends);
    }

    #[test]
    fn instances_come_and_go_with_tasks_still_waiting() {
        for _ in 0..50 {
            let tasks = [0, 1, 2].map(|_| LOADER.add(Loader::new(Arc::new(PromenadeParams::default()))).unwrap());
            for task in &tasks {
                task.schedule();
            }
        }
    }
}
