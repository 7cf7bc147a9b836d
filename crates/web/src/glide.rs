//! Poses that come by messages, a screen's frames or a headset's apart, as a pose for every sample.
//!
//! Steps at 72 Hz would put side lines beside a tone at -33 dB; on the straight line between two messages there are none. So a
//! pose is heard when the next one has had time to arrive: as long after it was taken as messages are apart, and as they are
//! late at most.

use promenade_core::Pose;
use std::collections::VecDeque;

/// Poses that wait, at most.
const WAITING: usize = 32;
/// Messages that are further apart than this are no stream: the listener stood still, seconds.
const PAUSE_S: f64 = 0.1;
/// The interval that is assumed before there is one, and the longest delay, seconds.
const FIRST_INTERVAL_S: f64 = 1.0 / 60.0;
const LONGEST_DELAY_S: f64 = 0.1;
/// A message that is later than this belongs to another clock than those before it, seconds.
const OTHER_CLOCK_S: f64 = 0.5;
/// Share of a new interval in the mean, and what is left of the worst lateness with each message.
const INTERVAL_SHARE: f64 = 0.1;
const LATENESS_KEPT: f64 = 0.998;
/// Delay beyond interval and lateness, as a share of the interval: standing still until the next pose comes would jerk.
const MARGIN: f64 = 0.05;
/// Share of the interval that lies between two poses at least.
const LEAST_SHARE: f64 = 0.25;
/// By how much clocks may run apart, and the delay may change, in time by time.
const DRIFT: f64 = 2e-4;
const WARP: f64 = 0.01;

/// A pose and the sample at which it is heard.
#[derive(Clone, Copy)]
struct Timed {
    at: f64,
    pose: Pose,
}

/// Poses of messages, on the way to the stream.
pub(crate) struct Glide {
    rate_hz: f64,
    waiting: VecDeque<Timed>,
    /// Sample of the stream at which a message of the sender's time 0 would arrive at the earliest.
    origin: f64,
    last_sent: f64,
    /// Mean time between messages, how late they are at most, and by how much poses are held back, samples.
    interval: f64,
    lateness: f64,
    delay: f64,
}

impl Glide {
    /// Begins at a pose.
    pub(crate) fn new(pose: Pose, rate_hz: f64) -> Self {
        let interval = FIRST_INTERVAL_S * rate_hz;
        let mut waiting = VecDeque::with_capacity(WAITING + 2);
        waiting.push_back(Timed { at: 0.0, pose });
        Self { rate_hz, waiting, origin: f64::INFINITY, last_sent: f64::NEG_INFINITY, interval, lateness: 0.0, delay: interval }
    }

    /// Is at a pose from now on.
    pub(crate) fn jump(&mut self, pose: Pose) {
        self.waiting.clear();
        self.waiting.push_back(Timed { at: 0.0, pose });
    }

    /// As new at its newest pose, for a stream that begins again.
    pub(crate) fn reset(&mut self) {
        let pose = self.newest();
        *self = Self::new(pose, self.rate_hz);
    }

    /// Time from a pose that is sent to its being heard, samples.
    pub(crate) fn delay(&self) -> f64 {
        self.delay
    }

    /// Takes a pose that was sent at a time of the sender's clock, seconds, and arrives at sample `now`.
    pub(crate) fn take(&mut self, pose: Pose, sent_s: f64, now: u64) {
        let (now, sent) = (now as f64, sent_s * self.rate_hz);
        if !pose.is_valid() || !sent.is_finite() {
            return;
        }
        let (gap, arrived) = (sent - self.last_sent, now - sent);
        if gap <= 0.0 && gap > -OTHER_CLOCK_S * self.rate_hz {
            // A second pose of the same frame takes the place of the first.
            if let Some(last) = self.waiting.back_mut() {
                last.pose = pose;
            }
            return;
        }
        self.last_sent = sent;
        let goes_on = gap > 0.0 && gap < PAUSE_S * self.rate_hz;
        self.origin = if (arrived - self.origin).abs() > OTHER_CLOCK_S * self.rate_hz {
            arrived
        } else {
            arrived.min(self.origin + DRIFT * gap)
        };
        if goes_on {
            self.interval += INTERVAL_SHARE * (gap - self.interval);
            self.lateness = (arrived - self.origin).max(LATENESS_KEPT * self.lateness);
        }
        let wanted = ((1.0 + MARGIN) * self.interval + self.lateness).min(LONGEST_DELAY_S * self.rate_hz);
        let most = if goes_on { WARP * gap } else { f64::INFINITY };
        self.delay += (wanted - self.delay).clamp(-most, most);
        let here = self.pose_at(now);
        let mut at = sent + self.origin + self.delay;
        // What is due together would leap: the newest pose is where the listener is.
        let least = LEAST_SHARE * self.interval;
        while self.waiting.back().is_some_and(|last| last.at > now && last.at > at - least) {
            self.waiting.pop_back();
        }
        if self.waiting.back().is_none_or(|last| last.at <= now) {
            self.jump(here);
            self.waiting[0].at = now;
            at = at.max(now + self.interval);
        }
        self.waiting.push_back(Timed { at, pose });
        if self.waiting.len() > WAITING {
            self.waiting.pop_front();
        }
    }

    /// The pose at a sample of the stream.
    pub(crate) fn pose_at(&self, sample: f64) -> Pose {
        let next = self.waiting.iter().position(|w| w.at > sample);
        let of = |i: usize| self.waiting[i];
        match next {
            None => self.newest(),
            Some(0) => of(0).pose,
            Some(next) => {
                let (a, b) = (of(next - 1), of(next));
                let share = ((sample - a.at) / (b.at - a.at)) as f32;
                Pose {
                    position: a.pose.position.lerp(b.pose.position, share),
                    orientation: a.pose.orientation.slerp(b.pose.orientation, share).normalize(),
                }
            }
        }
    }

    /// Forgets what lies before a sample, but for the pose there.
    pub(crate) fn forget_before(&mut self, sample: u64) {
        while self.waiting.len() > 1 && self.waiting[1].at <= sample as f64 {
            self.waiting.pop_front();
        }
    }

    fn newest(&self) -> Pose {
        self.waiting.back().map_or(Pose::IDENTITY, |last| last.pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::glam::Vec3;

    const RATE: f64 = 48_000.0;

    fn turned(t_s: f64) -> Pose {
        Pose::from_ypr64(Vec3::new(t_s as f32, 0.0, 0.0), [t_s, 0.0, 0.0])
    }

    /// Sends a steady turn by messages at 72 Hz, some late, in blocks of 128; the greatest distance from the turn some time
    /// ago, metres.
    fn worst(late_s: impl Fn(u64) -> f64, from_s: f64) -> (f64, f64) {
        let mut glide = Glide::new(turned(0.0), RATE);
        let (mut sent, mut worst) = (0, 0.0_f64);
        for block in 0..1_500_u64 {
            let start = block * 128;
            glide.forget_before(start);
            // Sent at a clock of its own; what has arrived before the block is taken at its start.
            while (sent as f64 / 72.0 + late_s(sent)) * RATE <= start as f64 {
                let t_s = sent as f64 / 72.0;
                glide.take(turned(t_s), t_s + 1_000.0, start);
                sent += 1;
            }
            if start as f64 > from_s * RATE {
                for i in 0..128 {
                    let x = f64::from(glide.pose_at((start + i) as f64).position.x);
                    let heard = (start + i) as f64 / RATE - glide.delay() / RATE;
                    worst = worst.max((x - heard).abs());
                }
            }
        }
        (worst, glide.delay() / RATE)
    }

    #[test]
    fn a_steady_turn_by_messages_is_a_steady_turn() {
        let (off_m, delay_s) = worst(|_| 0.0, 2.0);
        // At 1 m/s: the origin is known to a block.
        assert!(off_m < 3e-3 && delay_s < 0.018, "{off_m} m, {delay_s} s");
        let (off_m, delay_s) = worst(|i| if i % 7 == 3 { 0.006 } else { 0.0 }, 2.0);
        assert!(off_m < 3e-3 && delay_s < 0.026, "late messages: {off_m} m, {delay_s} s");
    }

    #[test]
    fn speed_is_even_though_messages_are_not() {
        let mut glide = Glide::new(turned(0.0), RATE);
        let mut sent = 0;
        let mut last = 0.0;
        for block in 0..1_500_u64 {
            let start = block * 128;
            glide.forget_before(start);
            while sent as f64 / 72.0 * RATE <= start as f64 {
                glide.take(turned(sent as f64 / 72.0), sent as f64 / 72.0, start);
                sent += 1;
            }
            let x = f64::from(glide.pose_at(start as f64).position.x);
            let step_s = x - last;
            last = x;
            if block > 500 {
                assert!((step_s * RATE / 128.0 - 1.0).abs() < 0.02, "block {block}: {} times as fast", step_s * RATE / 128.0);
            }
        }
    }

    #[test]
    fn messages_that_come_late_and_together_make_no_leap() {
        let mut glide = Glide::new(turned(0.0), RATE);
        let (mut sent, mut last, mut steepest) = (0, 0.0_f32, 0.0_f32);
        for block in 0..1_500_u64 {
            let start = block * 128;
            glide.forget_before(start);
            // Messages of .25 s arrive at its end.
            let held = (144..162).contains(&sent) && start < 162 * 48_000 / 72;
            while !held && sent as f64 / 72.0 * RATE <= start as f64 {
                glide.take(turned(sent as f64 / 72.0), sent as f64 / 72.0, start);
                sent += 1;
            }
            for i in 0..128 {
                let x = glide.pose_at((start + i) as f64).position.x;
                steepest = steepest.max(x - last);
                last = x;
            }
        }
        let times = f64::from(steepest) * RATE;
        assert!(times < 25.0, "{times} times the speed of the turn");
        assert!((f64::from(last) - 4.0).abs() < 0.15, "it is at {last} s");
    }

    #[test]
    fn after_a_pause_it_moves_on_from_where_it_stood() {
        let mut glide = Glide::new(turned(0.0), RATE);
        glide.take(turned(0.01), 0.0, 0);
        assert!((glide.pose_at(48_000.0).position.x - 0.01).abs() < 1e-6);
        glide.forget_before(48_000);
        glide.take(turned(0.02), 1.0, 48_000);
        assert!((glide.pose_at(48_000.0).position.x - 0.01).abs() < 1e-4, "no jump");
        assert!((glide.pose_at(48_000.0 + 4_800.0).position.x - 0.02).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_pose_is_dropped_and_another_clock_is_taken() {
        let mut glide = Glide::new(turned(0.0), RATE);
        glide.take(Pose { position: Vec3::NAN, ..Pose::IDENTITY }, 0.0, 0);
        glide.take(turned(0.5), f64::NAN, 0);
        assert_eq!(glide.pose_at(1e6), turned(0.0));
        glide.take(turned(0.5), 100.0, 0);
        glide.take(turned(0.6), 3.0, 128);
        assert_eq!(glide.pose_at(1e6), turned(0.6));
    }
}
