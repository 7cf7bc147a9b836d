//! Where the host's transport stands at the first sample of a block.

/// Follows the host's position, and counts on by itself where the host gives none or repeats one.
///
/// Hosts repeat a position when a wrapper cuts their block at parameter changes without a tempo to move the position by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    reported_s: Option<f64>,
    since: u64,
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
        if reported_s != self.reported_s {
            *self = Self { reported_s, since: 0 };
        }
        let runs = playing || reported_s.is_none();
        #[expect(clippy::cast_precision_loss, reason = "a count of samples is exact for thousands of years")]
        let past_s = if runs { self.since as f64 / sample_rate_hz } else { 0.0 };
        if runs {
            self.since += samples as u64;
        } else {
            self.since = 0;
        }
        reported_s.unwrap_or(0.0) + past_s
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
