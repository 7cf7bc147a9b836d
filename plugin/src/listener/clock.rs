//! Where the host's transport stands at the first sample of a block.

/// The time of one block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockTime {
    /// Time of the transport at the first sample, seconds.
    pub start_s: f64,
    /// Length of the block, seconds.
    pub length_s: f64,
    /// Whether the transport runs.
    pub playing: bool,
    /// Whether the transport was moved to this block: located, or wound back by a loop.
    pub moved: bool,
}

impl BlockTime {
    /// Time of the transport at the end of the block, seconds.
    pub fn end_s(&self) -> f64 {
        self.start_s + self.length_s
    }
}

/// A step of the position, beyond the block's own length, that counts as relocated, seconds; hosts round positions.
const RELOCATED_S: f64 = 0.02;

/// Follows the host's position, and counts samples by itself where the host reports none or repeats one.
///
/// Hosts repeat a position when a wrapper cuts their block at parameter changes without a tempo to move the position by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    reported_s: Option<f64>,
    since: u64,
    /// Where the next block is expected to begin, seconds, while the transport runs.
    expected_s: Option<f64>,
}

impl Clock {
    /// The host's last position, seconds.
    pub fn reported_s(&self) -> Option<f64> {
        self.reported_s
    }

    /// The time of the next block, of `samples` samples.
    ///
    /// `reported_s` is the host's position in seconds, if it reports one. A stopped transport stands still; without a position
    /// the time runs from [`Clock::default`] on.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn advance(&mut self, reported_s: Option<f64>, playing: bool, samples: usize, sample_rate_hz: f64) -> BlockTime {
        let reported_s = reported_s.filter(|s| s.is_finite());
        let moved = match (self.expected_s, reported_s) {
            (Some(expected), Some(found)) => {
                found != self.reported_s.unwrap_or(found) && (found - expected).abs() > RELOCATED_S
            }
            _ => false,
        };
        if reported_s != self.reported_s {
            (self.reported_s, self.since) = (reported_s, 0);
        }
        let runs = playing || reported_s.is_none();
        let past_s = if runs { self.since as f64 / sample_rate_hz } else { 0.0 };
        self.since = if runs { self.since + samples as u64 } else { 0 };
        let start_s = reported_s.unwrap_or(0.0) + past_s;
        let length_s = samples as f64 / sample_rate_hz;
        self.expected_s = reported_s.map(|_| start_s + if playing { length_s } else { 0.0 });
        BlockTime { start_s, length_s, playing, moved }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_a_host_that_reports_its_position() {
        let mut clock = Clock::default();
        assert_eq!(clock.advance(Some(2.0), true, 480, 48e3).start_s, 2.0);
        assert_eq!(clock.advance(Some(2.01), true, 480, 48e3).start_s, 2.01);
        assert_eq!(clock.advance(Some(0.5), true, 480, 48e3).start_s, 0.5);
    }

    #[test]
    fn notices_when_the_transport_is_moved() {
        let mut clock = Clock::default();
        let mut moved = |position_s, playing| clock.advance(Some(position_s), playing, 480, 48e3).moved;
        assert!(!moved(2.0, true), "it starts somewhere");
        moved(2.01, true);
        assert!(!moved(2.01, true), "it plays on, in pieces");
        assert!(moved(7.0, true), "it was located");
        assert!(!moved(7.01, true));
        assert!(moved(0.0, false), "it was wound back");
    }

    #[test]
    fn counts_on_through_the_pieces_of_one_host_block() {
        let mut clock = Clock::default();
        clock.advance(Some(2.0), true, 480, 48e3);
        assert_eq!(clock.advance(Some(2.0), true, 480, 48e3).start_s, 2.01);
    }

    #[test]
    fn stands_still_with_the_transport_and_runs_without_one() {
        let mut clock = Clock::default();
        clock.advance(Some(2.0), false, 480, 48e3);
        assert_eq!(clock.advance(Some(2.0), false, 480, 48e3).start_s, 2.0);
        clock.advance(None, false, 480, 48e3);
        assert_eq!(clock.advance(None, false, 480, 48e3).start_s, 0.01);
    }
}
