//! What has come in for one instance.

use crate::pose_cell::PoseCell;
use promenade_core::Pose;
use std::sync::atomic::{AtomicBool, Ordering};

/// The newest of a tracker, from the network thread to the audio thread.
#[derive(Default)]
pub struct Inbox {
    tracked: PoseCell,
    present: AtomicBool,
}

impl Inbox {
    /// Takes a tracker's pose, mapped to the head's axes and recentred. One thread calls it.
    ///
    /// A tracker that sends no position stands at the origin, one that sends no orientation faces ahead.
    pub fn track(&self, pose: &Pose) {
        self.tracked.write(0.0, pose);
        self.present.store(true, Ordering::Release);
    }

    /// There is no tracker any more.
    pub fn lose(&self) {
        self.present.store(false, Ordering::Release);
    }

    /// The tracker's newest pose, if there is a tracker.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    #[must_use]
    pub fn tracked(&self) -> Option<Pose> {
        if self.present.load(Ordering::Acquire) { self.tracked.read().map(|(_, pose)| pose) } else { None }
    }
}
