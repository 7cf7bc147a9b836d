//! A budget of processor time that all instances of the process share, spent where it is heard.
//!
//! An allocator off the audio threads looks at all instances some times a second and grants each what it may play ([`Grant`]), by how loud it is
//! at the ears and what it costs. Without a limit nobody is asked and everything is played as it is set.

mod allocator;
mod grant;
mod share;
mod spender;
mod stop_watch;

pub use grant::Grant;
pub use share::Share;
pub(crate) use spender::Spender;

use crate::lock::lock;
use crate::members;
use crate::worker::{ALLOCATOR, Task, TaskHandle};
use allocator::allocate;
use nice_plug::params::persist::PersistentField;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

/// Time between two looks at all instances.
const PERIOD: Duration = Duration::from_millis(100);
/// The least and the greatest limit, percent of one core.
pub const LIMITS_PERCENT: (f32, f32) = (1.0, 1600.0);

/// The limit, percent of one core, by its bits; 0 for none.
static LIMIT: AtomicU32 = AtomicU32::new(0);
/// What looks at all instances, as long as there is one.
static HANDLE: Mutex<Weak<TaskHandle>> = Mutex::new(Weak::new());

/// The most that all instances may take together, percent of one core; `None` for no limit.
///
/// # Real-time
/// Any thread; no allocation, lock or I/O.
#[must_use]
pub fn limit_percent() -> Option<f32> {
    let percent = f32::from_bits(LIMIT.load(Ordering::Relaxed));
    (percent > 0.0).then_some(percent)
}

/// Sets that limit, within [`LIMITS_PERCENT`]; what is no number above 0 means none.
pub fn set_limit_percent(percent: Option<f32>) {
    let percent = percent.filter(|percent| *percent > 0.0).map_or(0.0, |p| p.clamp(LIMITS_PERCENT.0, LIMITS_PERCENT.1));
    LIMIT.store(percent.to_bits(), Ordering::Relaxed);
    if let Some(handle) = lock(&HANDLE).upgrade() {
        handle.schedule();
    }
}

/// The allocator, for an instance to hold as long as it may play.
///
/// # Errors
/// The system gives no thread.
fn join() -> std::io::Result<Arc<TaskHandle>> {
    let mut held = lock(&HANDLE);
    if let Some(handle) = held.upgrade() {
        return Ok(handle);
    }
    let handle = Arc::new(ALLOCATOR.add(Arc::new(Allocation))?);
    *held = Arc::downgrade(&handle);
    handle.schedule();
    Ok(handle)
}

/// One look at all instances.
struct Allocation;

impl Task for Allocation {
    fn run(&self) -> Option<Instant> {
        let percent = limit_percent()?;
        let shares = members::shares();
        let claims: Vec<_> = shares.iter().map(|share| share.claim()).collect();
        for (share, grant) in shares.iter().zip(allocate(&claims, percent / 100.0)) {
            share.give(grant);
        }
        Some(Instant::now() + PERIOD)
    }
}

/// The limit as projects keep it: each instance saves the one that holds for all, and the last that is restored sets it.
#[derive(Default)]
pub struct SavedLimit;

impl PersistentField<'_, Option<f32>> for SavedLimit {
    fn set(&self, saved: Option<f32>) {
        set_limit_percent(saved);
    }

    fn map<F, R>(&self, f: F) -> R
    where
        F: Fn(&Option<f32>) -> R,
    {
        f(&limit_percent())
    }
}
