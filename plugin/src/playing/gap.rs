//! The silence in which the host activates the plugin again, because the next scene has another latency.
//!
//! What is heard fades out; the next scene takes its place in silence and the host is asked; what it plays fades in once the
//! host has done so, or does not seem to. Without it the old scene would end in the middle of a sound, and the new one begin
//! there.

use crate::parameter::cast::{narrow, normal};

/// Length of either fade, seconds.
const FADE_S: f64 = 0.02;
/// How long the host is waited for, seconds.
const WAIT_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum State {
    /// There is none.
    #[default]
    Closed,
    /// The old scene fades out.
    Out,
    /// Silence, so many samples of it so far.
    Waiting(usize),
    /// The new scene fades in after so many samples.
    In(usize),
}

/// Silence between two scenes, of one instance. The audio thread owns it.
#[derive(Debug, Default)]
pub(crate) struct Gap {
    state: State,
    /// Gain of what is heard, lowered by 1 so that a new one is at full level.
    lowered: f32,
}

impl Gap {
    /// Begins to fade out.
    pub(crate) fn open(&mut self) {
        if matches!(self.state, State::Closed | State::In(_)) {
            self.state = State::Out;
        }
    }

    /// Whether nothing is heard of the old scene any more and the new one may take its place.
    pub(crate) fn is_silent(&self) -> bool {
        self.state == State::Out && self.lowered >= 1.0
    }

    /// The new scene has taken the place: the host is waited for.
    pub(crate) fn wait(&mut self) {
        self.state = State::Waiting(0);
    }

    /// The host begins anew, with nothing of the past: what comes fades in where it was silent, once it is heard after its
    /// latency.
    pub(crate) fn begin(&mut self, latency: usize) {
        if self.state != State::Closed {
            (self.state, self.lowered) = (State::In(latency), 1.0);
        }
    }

    /// Fades a block of what was rendered.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn fade(&mut self, channels: &mut [&mut [f32]], sample_rate_hz: f64) {
        let len = channels.first().map_or(0, |channel| channel.len());
        let (target, from) = match &mut self.state {
            State::Closed => return,
            State::Out => (1.0, 0),
            State::Waiting(past) => {
                *past = past.saturating_add(len);
                if *past as f64 > WAIT_S * sample_rate_hz {
                    self.state = State::In(0);
                }
                (1.0, 0)
            }
            State::In(after) => {
                let from = (*after).min(len);
                *after -= from;
                (0.0, from)
            }
        };
        // A little more than its share, so that rounding leaves nothing of it.
        let step = 1.001 * narrow((FADE_S * sample_rate_hz).max(1.0).recip());
        let mut end = self.lowered;
        for channel in channels {
            end = self.lowered;
            let (before, rest) = channel.split_at_mut(from.min(channel.len()));
            before.iter_mut().for_each(|x| *x = normal(*x * (1.0 - end)));
            for x in rest {
                end += (target - end).clamp(-step, step);
                *x = normal(*x * (1.0 - end));
            }
        }
        self.lowered = end;
        if matches!(self.state, State::In(0)) && end == 0.0 {
            self.state = State::Closed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 48_000.0;
    const BLOCK: usize = 480;

    /// Plays blocks of ones; returns what is heard.
    fn heard(gap: &mut Gap, blocks: usize) -> Vec<f32> {
        let block = |gap: &mut Gap| {
            let (mut left, mut right) = ([1.0; BLOCK], [1.0; BLOCK]);
            gap.fade(&mut [&mut left, &mut right], RATE_HZ);
            assert_eq!(left, right);
            left
        };
        (0..blocks).flat_map(|_| block(gap)).collect()
    }

    #[test]
    fn it_goes_down_and_comes_back_without_a_step() {
        let mut gap = Gap::default();
        assert!(heard(&mut gap, 2).iter().all(|x| *x == 1.0));
        gap.open();
        let mut all = heard(&mut gap, 2);
        assert!(gap.is_silent());
        gap.wait();
        all.extend(heard(&mut gap, 2));
        gap.begin(100);
        all.extend(heard(&mut gap, 4));
        let step = all.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
        assert!(step <= 1.1 / 960.0, "a step of {step}");
        assert_eq!((all[2 * BLOCK], all[4 * BLOCK + 99]), (0.0, 0.0));
        assert_eq!(all.last(), Some(&1.0));
        assert_eq!(gap.state, State::Closed);
    }

    #[test]
    fn a_host_that_does_nothing_is_not_waited_for_any_longer() {
        let mut gap = Gap::default();
        gap.open();
        heard(&mut gap, 2);
        gap.wait();
        let all = heard(&mut gap, 13);
        assert!(all[..10 * BLOCK].iter().all(|x| *x == 0.0));
        assert_eq!(all.last(), Some(&1.0));
    }

    #[test]
    fn a_beginning_without_a_gap_is_heard_at_once() {
        let mut gap = Gap::default();
        gap.begin(780);
        assert!(heard(&mut gap, 1).iter().all(|x| *x == 1.0));
    }

    #[test]
    fn what_is_faint_fades_to_nothing_and_not_to_subnormal_numbers() {
        let mut gap = Gap::default();
        gap.open();
        let mut faint = [2e-38; BLOCK];
        gap.fade(&mut [&mut faint], RATE_HZ);
        assert!(faint[0] > 0.0 && faint[BLOCK - 1] == 0.0);
        assert!(!faint.iter().any(|x| x.is_subnormal()));
    }
}
