//! The audio thread's end of the budget.

use super::{Account, join, register};
use super::{allocator::USUAL_COSTS, grant::Grant, stop_watch::StopWatch};
use crate::budget::limit::limit_percent;
use crate::parameter::cast::{index, narrow, normal};
use crate::worker::TaskHandle;
use nice_plug::nice_error;
use promenade_core::{BlockParams, Tier};
use std::sync::Arc;

/// Time in which an instance that waits falls silent, or comes back, seconds.
const FADE_S: f32 = 0.02;
/// Time constant over which levels are measured, seconds; they rise at once.
const LEVEL_S: f32 = 0.4;
/// Time constant over which costs are measured, seconds; they rise at once.
const COST_S: f32 = 0.5;
/// Time constant over which the cost of what is not played is forgotten in favour of the usual one, seconds: one that was once
/// measured too high would never be played again.
const FORGET_S: f32 = 10.0;
/// Fainter than this is silence, mean square.
const SILENCE: f32 = 1e-12;

/// What one instance plays of itself, block by block. The audio thread owns it.
#[derive(Default)]
pub(crate) struct Spender {
    account: Arc<Account>,
    task: Option<Arc<TaskHandle>>,
    /// What is played of this block.
    now: Grant,
    /// Level of what is played, 0 while it waits.
    level: f32,
    /// Samples of input taken since it began anew, and how many it takes until all of it is heard.
    taken: usize,
    settled: usize,
    /// Whether something was not rendered since it began.
    waited: bool,
    /// Mean squares of the input and of both ears.
    input: f32,
    ears: f32,
    /// Power from the input to the ears when it was last heard, and the listener's distance then, metres.
    gain: f32,
    gain_at_m: f32,
    /// Whether there is a limit for this block.
    limited: bool,
    /// Mean square of this block's input.
    power: f32,
    /// Whether this block's input is silent, where there is a limit.
    pub(crate) quiet: bool,
}

impl Spender {
    /// Plays everything, and allocates nothing.
    pub(crate) fn new(account: Arc<Account>) -> Self {
        Self { account, level: 1.0, gain: 1.0, gain_at_m: 1.0, quiet: true, ..Self::default() }
    }

    /// Starts what allocates, where it does not run yet.
    pub(crate) fn activate(&mut self) {
        register::add(&self.account);
        if self.task.is_none() {
            match join() {
                Ok(task) => self.task = Some(task),
                Err(error) => nice_error!("no thread for the budget of processor time: {error}"),
            }
        }
    }

    /// Chooses what is played of a block whose inputs have a mean square of `power`, and sets it so. An instance that leads
    /// others or is bypassed does not wait; offline there is no budget. Returns what measures the block's time, where there
    /// is a limit.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. Wakes a thread when a sound begins.
    pub(crate) fn begin(
        &mut self,
        block: &mut BlockParams,
        power: impl FnOnce() -> f32,
        offline: bool,
        leads: bool,
    ) -> Option<StopWatch> {
        self.limited = limit_percent().is_some() && !offline;
        let held = if self.limited { self.account.held() } else { Grant::Full };
        if self.limited {
            self.power = power();
            let quiet = self.power <= SILENCE;
            if std::mem::replace(&mut self.quiet, quiet)
                && !quiet
                && let Some(task) = &self.task
            {
                task.schedule();
            }
        }
        self.now = if leads || block.bypass { held.max(Grant::Draft) } else { held };
        match self.now {
            Grant::Full => (),
            Grant::Draft | Grant::Nothing => block.tier = Tier::Draft,
        }
        self.limited.then(StopWatch::start)
    }

    /// Whether nothing has to be rendered: it waits, and what was heard has faded out.
    pub(crate) fn waits(&mut self) -> bool {
        self.waited |= self.now == Grant::Nothing && self.level == 0.0;
        self.waited && self.now == Grant::Nothing
    }

    /// Whether it has waited and is to begin anew with this block, at a latency in samples.
    pub(crate) fn wakes(&mut self, latency: usize, sample_rate_hz: f64) -> bool {
        let wakes = self.now != Grant::Nothing && self.waited;
        if wakes {
            (self.waited, self.level) = (false, 1.0);
            (self.taken, self.settled) = (0, latency + fade_samples(sample_rate_hz));
        }
        wakes
    }

    /// Fades so many samples of all inputs in after it has begun anew: in the middle of a sound its beginning would be a
    /// click, which the room would prolong.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn fade_in<'a>(&mut self, input: impl Iterator<Item = &'a mut [f32]>, len: usize, sample_rate_hz: f64) {
        let fade = fade_samples(sample_rate_hz);
        if self.taken < self.settled {
            for channel in input {
                let gains = (self.taken..fade).map(|at| at as f32 / fade as f32);
                channel.iter_mut().zip(gains).for_each(|(x, gain)| *x *= gain);
            }
            self.taken += len;
        }
    }

    /// Fades what was rendered out before it waits, and back in where it need not wait after all.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn fade(&mut self, channels: &mut [&mut [f32]], sample_rate_hz: f64) {
        let target = if self.now == Grant::Nothing { 0.0 } else { 1.0 };
        if self.level == target {
            return;
        }
        let step = 1.0 / fade_samples(sample_rate_hz) as f32;
        let mut end = self.level;
        for channel in channels {
            end = self.level;
            for x in channel.iter_mut() {
                end += (target - end).clamp(-step, step);
                *x = normal(*x * end);
            }
        }
        self.level = end;
    }

    /// Measures a block for the allocator: its time, both ears, the distance to the emitter, metres, the tier that the user has
    /// set, and the length of the sound, seconds.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn end(&mut self, watch: &StopWatch, ears: [&[f32]; 2], away_m: f32, tier: Tier, length_s: f64) {
        let took = watch.elapsed();
        let (length, length_s) = (narrow(length_s), length_s.max(1e-9));
        follow(&mut self.input, self.power, length);
        follow(&mut self.ears, mean_square(ears), length);
        let away_m = away_m.max(promenade_core::NEAREST_M);
        let most = if tier == Tier::Draft { Grant::Draft } else { Grant::Full };
        // A draft is fainter than what it stands for.
        if self.now == most && self.level == 1.0 && self.taken >= self.settled && self.input > SILENCE && self.ears > SILENCE {
            (self.gain, self.gain_at_m) = (self.ears / self.input, away_m);
        }
        let expected = self.input * self.gain * (self.gain_at_m / away_m).powi(2);
        self.account.note(if self.now == Grant::Nothing { expected } else { expected.max(self.ears) }, most);
        // A silent source costs next to nothing: that is not what its grant takes.
        if self.input > SILENCE {
            let found = narrow(took.as_secs_f64() / length_s);
            let cost = self.learn(self.now, found, length / COST_S);
            for other in [Grant::Draft, Grant::Full].into_iter().filter(|other| self.now > Grant::Nothing && *other != self.now)
            {
                let usual = cost * USUAL_COSTS[other as usize] / USUAL_COSTS[self.now as usize];
                self.learn(other, usual, length / FORGET_S);
            }
        }
    }

    /// Takes in what a grant was found to take, over `times` of a time constant. Returns what it is now taken to take.
    fn learn(&self, grant: Grant, found: f32, times: f32) -> f32 {
        let known = self.account.cost_of(grant);
        let cost = if known > 0.0 { known + (1.0 - (-times).exp()) * (found - known) } else { found };
        self.account.note_cost(grant, cost);
        cost
    }
}

/// Length of a fade, samples, at least one.
fn fade_samples(sample_rate_hz: f64) -> usize {
    index(FADE_S * narrow(sample_rate_hz)).max(1)
}

/// Mean square of two channels; 0 for what is no number.
fn mean_square(channels: [&[f32]; 2]) -> f32 {
    let sum: f32 = channels.iter().copied().flatten().map(|x| x * x).sum();
    let mean = sum / channels.iter().map(|channel| channel.len()).sum::<usize>().max(1) as f32;
    if mean.is_finite() { mean } else { 0.0 }
}

/// Follows a mean square: up at once, down over [`LEVEL_S`].
fn follow(level: &mut f32, found: f32, length_s: f32) {
    *level = found.max(*level * (-length_s / LEVEL_S).exp());
    if *level < SILENCE {
        *level = 0.0;
    }
}
