//! Asks an open editor for its next picture.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Asks for the next picture, from any thread; the window checks at each frame whether one was asked for.
///
/// The window library's own notifier would keep a request that was made while no window was open, and make it before the next
/// window is on the screen: it then waits for ever for the answer, and the window stays blank.
#[derive(Clone, Debug, Default)]
pub struct Repaint(Arc<AtomicBool>);

impl Repaint {
    /// Asks for a picture.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn request_repaint(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether a picture was asked for since this was last called.
    pub fn take(&self) -> bool {
        self.0.swap(false, Ordering::AcqRel)
    }
}
