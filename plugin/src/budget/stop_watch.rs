//! How long a block takes.

#[cfg(not(windows))]
use cpu_time::ThreadTime as Clock;
use std::time::Duration;
// Windows counts a thread's time in steps longer than a block.
#[cfg(windows)]
use std::time::Instant as Clock;

/// Measures the processor time of this thread; on Windows time by the clock, in which other programs' work is counted too.
pub(crate) struct StopWatch(Clock);

impl StopWatch {
    /// Starts.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. One call of the system, which does not wait.
    pub(crate) fn start() -> Self {
        Self(Clock::now())
    }

    /// Time since.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}
