//! Where the host's transport stands at the first sample of a block.

/// A step of the position, beyond the block's own length, that counts as relocated, seconds; hosts round positions.
const RELOCATED_S: f64 = 0.02;

/// Follows the host's position, and counts on by itself where the host gives none or repeats one.
///
/// Hosts repeat a position when a wrapper cuts their block at parameter changes without a tempo to move the position by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    reported_s: Option<f64>,
    since: u64,
    /// Where the next block is expected to begin, seconds, while the transport runs.
    expected_s: Option<f64>,
    moved: bool,
}

impl Clock {
    /// Seconds at the first sample of a block of `samples`, which are then counted.
    ///
    /// `reported_s` is the host's position, if it tells one; a stopped transport stands still, without a position the time since
    /// [`Clock::default`] counts.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn advance(&mut self, reported_s: Option<f64>, playing: bool, samples: usize, sample_rate_hz: f64) -> f64 {
        let reported_s = reported_s.filter(|s| s.is_finite());
        self.moved = match (self.expected_s, reported_s) {
            (Some(expected), Some(found)) => {
                found != self.reported_s.unwrap_or(found) && (found - expected).abs() > RELOCATED_S
            }
            _ => false,
        };
        if reported_s != self.reported_s {
            (self.reported_s, self.since) = (reported_s, 0);
        }
        let runs = playing || reported_s.is_none();
        #[expect(clippy::cast_precision_loss, reason = "a count of samples is exact for thousands of years")]
        let past_s = if runs { self.since as f64 / sample_rate_hz } else { 0.0 };
        if runs {
            self.since += samples as u64;
        } else {
            self.since = 0;
        }
        let now_s = reported_s.unwrap_or(0.0) + past_s;
        #[expect(clippy::cast_precision_loss, reason = "a block's length is exact")]
        let block_s = if playing { samples as f64 / sample_rate_hz } else { 0.0 };
        self.expected_s = reported_s.map(|_| now_s + block_s);
        now_s
    }

    /// Whether the transport was moved to the block that was last asked about: located, or wound back by a loop.
    #[must_use]
    pub fn moved(&self) -> bool {
        self.moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_a_host_that_tells_its_position() {
        let mut clock = Clock::default();
        assert_eq!(clock.advance(Some(2.0), true, 480, 48e3), 2.0);
        assert_eq!(clock.advance(Some(2.01), true, 480, 48e3), 2.01);
        assert_eq!(clock.advance(Some(0.5), true, 480, 48e3), 0.5);
    }

    #[test]
    fn notices_when_the_transport_is_moved() {
        let mut clock = Clock::default();
        clock.advance(Some(2.0), true, 480, 48e3);
        assert!(!clock.moved(), "it starts somewhere");
        clock.advance(Some(2.01), true, 480, 48e3);
        clock.advance(Some(2.01), true, 480, 48e3);
        assert!(!clock.moved(), "it plays on, in pieces");
        clock.advance(Some(7.0), true, 480, 48e3);
        assert!(clock.moved(), "it was located");
        clock.advance(Some(7.01), true, 480, 48e3);
        assert!(!clock.moved());
        clock.advance(Some(0.0), false, 480, 48e3);
        assert!(clock.moved(), "it was wound back");
    }

    #[test]
    fn counts_on_through_the_pieces_of_one_host_block() {
        let mut clock = Clock::default();
        clock.advance(Some(2.0), true, 480, 48e3);
        assert_eq!(clock.advance(Some(2.0), true, 480, 48e3), 2.01);
    }

    #[test]
    fn stands_still_with_the_transport_and_runs_without_one() {
        let mut clock = Clock::default();
        clock.advance(Some(2.0), false, 480, 48e3);
        assert_eq!(clock.advance(Some(2.0), false, 480, 48e3), 2.0);
        clock.advance(None, false, 480, 48e3);
        assert_eq!(clock.advance(None, false, 480, 48e3), 0.01);
    }
}
