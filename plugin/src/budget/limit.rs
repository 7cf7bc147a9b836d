//! The limit of the budget of processor time: the most that all instances of the process may take together.

use crate::worker::{TaskHandle, lock::lock};
use nice_plug::params::persist::PersistentField;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, Weak};

/// The least and the greatest limit, percent of one core.
pub const LIMITS_PERCENT: (f32, f32) = (1.0, 1600.0);

/// The limit, percent of one core, by its bits; 0 for none.
static LIMIT: AtomicU32 = AtomicU32::new(0);
/// What shares the budget out, as long as there is an instance: it is told of another limit.
pub(crate) static ALLOCATION: Mutex<Weak<TaskHandle>> = Mutex::new(Weak::new());

/// The most that all instances may take together, percent of one core; `None` for no limit.
///
/// # Real-time
/// Any thread; no allocation, lock or I/O.
pub fn limit_percent() -> Option<f32> {
    let percent = f32::from_bits(LIMIT.load(Ordering::Relaxed));
    (percent > 0.0).then_some(percent)
}

/// Sets that limit, within [`LIMITS_PERCENT`]; what is no number above 0 means none.
pub fn set_limit_percent(percent: Option<f32>) {
    let percent = percent.filter(|percent| *percent > 0.0).map_or(0.0, |p| p.clamp(LIMITS_PERCENT.0, LIMITS_PERCENT.1));
    LIMIT.store(percent.to_bits(), Ordering::Relaxed);
    if let Some(handle) = lock(&ALLOCATION).upgrade() {
        handle.schedule();
    }
}

/// The limit as projects keep it: each instance saves the one that holds for all, and the last that is restored sets it.
#[derive(Default)]
pub struct SavedLimit;

impl PersistentField<'_, Option<f32>> for SavedLimit {
    fn set(&self, saved: Option<f32>) {
        set_limit_percent(saved);
    }

    fn map<F: Fn(&Option<f32>) -> R, R>(&self, f: F) -> R {
        f(&limit_percent())
    }
}
