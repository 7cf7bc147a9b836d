//! A switch that threads share.

use std::sync::atomic::{AtomicBool, Ordering};

/// A switch that threads share, off at first. It orders nothing else.
#[derive(Debug, Default)]
pub struct Flag(AtomicBool);

impl Flag {
    /// Whether it is on.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn is_on(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Switches it.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn set(&self, on: bool) {
        self.0.store(on, Ordering::Relaxed);
    }
}
