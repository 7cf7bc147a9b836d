//! Whether the host renders offline, judged by the pace of its blocks.
//!
//! The VST3 wrapper passes on the mode that was set before the last one, so that the first bounce after playing looks like
//! playing and playing after a bounce looks like a bounce. Whether decodes are waited for must not depend on that alone.

use std::time::{Duration, Instant};

/// Audio after which the pace is judged, seconds; longer than the bursts in which hosts cut a device's buffer.
const WINDOW_S: f64 = 0.2;
/// Blocks that take less than this share of their own length are rendered offline.
const FAST: f64 = 0.5;
/// Blocks that keep to their own length within this share are played live.
const STEADY: f64 = 0.1;
/// They leave at least this share of the time to the host; a bounce that waits for decodes may be as slow, but waits here.
const LEFT: f64 = 0.2;
/// Steady windows in a row before an offline rendering is taken for live playing.
const STEADY_WINDOWS: u32 = 3;

/// Tells offline rendering from live playing for one instance.
#[derive(Clone, Copy, Debug, Default)]
pub struct OfflineDetector {
    offline: bool,
    /// Whether the mode that the host reports is correct.
    trusted: bool,
    since: Option<Instant>,
    played_s: f64,
    /// Time of the window that was spent in the plugin.
    spent: Duration,
    steady: u32,
}

impl OfflineDetector {
    /// Starts with the mode that the host reports; with `trusted` it is not judged further.
    #[must_use]
    pub fn new(offline: bool, trusted: bool) -> Self {
        Self { offline, trusted, ..Self::default() }
    }

    /// Counts a block of `block_s` seconds that is asked for at `now`. Returns whether the host renders offline.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn advance(&mut self, now: Instant, block_s: f64) -> bool {
        if self.trusted {
            return self.offline;
        }
        let since = *self.since.get_or_insert(now);
        if self.played_s >= WINDOW_S {
            self.judge(now.saturating_duration_since(since));
            (self.since, self.played_s, self.spent) = (Some(now), 0.0, Duration::ZERO);
        }
        self.played_s += block_s;
        self.offline
    }

    /// Counts the time for which the plugin was at work on the block that was counted last.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn spend(&mut self, time: Duration) {
        self.spent = self.spent.saturating_add(time);
    }

    fn judge(&mut self, past: Duration) {
        let share = past.as_secs_f64() / self.played_s;
        if share < FAST {
            self.offline = true;
        }
        let is_steady = (share - 1.0).abs() < STEADY && self.spent < past.mul_f64(1.0 - LEFT);
        self.steady = if is_steady { self.steady + 1 } else { 0 };
        if self.steady >= STEADY_WINDOWS {
            self.offline = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK_S: f64 = 0.01;

    /// What is detected after `blocks` blocks, each asked for `share` of its length after the last.
    fn after(detector: &mut OfflineDetector, start: Instant, blocks: u32, share: f64) -> bool {
        (0..blocks).map(|n| detector.advance(start + Duration::from_secs_f64(BLOCK_S * share) * n, BLOCK_S)).last().unwrap()
    }

    #[test]
    fn a_bounce_that_looks_like_playing_is_noticed() {
        let mut detector = OfflineDetector::new(false, false);
        assert!(!after(&mut detector, Instant::now(), 10, 0.05), "too early to tell");
        assert!(after(&mut detector, Instant::now(), 60, 0.05));
    }

    #[test]
    fn playing_that_looks_like_a_bounce_is_noticed() {
        let mut detector = OfflineDetector::new(true, false);
        assert!(!after(&mut detector, Instant::now(), 100, 1.0));
    }

    #[test]
    fn a_slow_bounce_stays_one_and_bursts_of_a_device_are_playing() {
        let start = Instant::now();
        let mut detector = OfflineDetector::new(true, false);
        assert!(after(&mut detector, start, 200, 3.0));
        let mut detector = OfflineDetector::new(false, false);
        for n in 0..400 {
            // Four blocks at once, then a wait.
            let now = start + Duration::from_secs_f64(BLOCK_S * 4.0) * (n / 4);
            assert!(!detector.advance(now, BLOCK_S));
        }
    }

    #[test]
    fn a_bounce_that_waits_as_long_as_it_plays_stays_one() {
        let start = Instant::now();
        let mut detector = OfflineDetector::new(true, false);
        for n in 0..400 {
            assert!(detector.advance(start + Duration::from_secs_f64(BLOCK_S) * n, BLOCK_S));
            detector.spend(Duration::from_secs_f64(0.9 * BLOCK_S));
        }
    }

    #[test]
    fn a_host_that_can_be_relied_on_is_believed() {
        assert!(after(&mut OfflineDetector::new(true, true), Instant::now(), 400, 1.0));
        assert!(!after(&mut OfflineDetector::new(false, true), Instant::now(), 400, 0.01));
    }
}
