//! Hands requests for pictures on to a window.

use crate::worker::repaint::Repaint;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// How often requests are looked for.
const PERIOD: Duration = Duration::from_millis(16);

/// A thread that looks for requests until it is dropped.
pub(super) struct Pump {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Pump {
    /// Begins, for a window that is on the screen.
    pub(super) fn start(repaint: Repaint, window: egui::Context) -> io::Result<Self> {
        let over = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&over);
        let look = move || {
            while !told.load(Ordering::Acquire) {
                if repaint.take() {
                    window.request_repaint();
                }
                thread::park_timeout(PERIOD);
            }
        };
        let thread = thread::Builder::new().name("promenade-editor".to_owned()).spawn(look)?;
        Ok(Self { over, thread: Some(thread) })
    }
}

impl Drop for Pump {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It has nothing that could fail.
            let _ended = thread.join();
        }
    }
}
