//! The audio thread's end of the budget.

use super::{Account, join, register};
use super::{allocator::BANDS, grant::Grant, stop_watch::StopWatch};
use crate::budget::limit::limit_percent;
use crate::parameter::cast::{index, narrow, normal};
use crate::parameter::choices::AccuracyChoice;
use crate::worker::TaskHandle;
use nice_plug::nice_error;
use std::sync::Arc;

/// Time in which an instance that waits falls silent, or comes back, seconds.
const FADE_S: f32 = 0.02;
/// Time constant over which levels are measured, seconds; they rise at once.
const LEVEL_S: f32 = 0.4;
/// Time constant over which costs are measured, seconds; they rise at once.
const COST_S: f32 = 0.5;
/// Where bands meet, Hz.
const EDGES_HZ: [f32; BANDS - 1] = [250.0, 1_000.0, 4_000.0];
/// Fainter than this is silence, mean square.
const SILENCE: f32 = 1e-12;

/// What one instance plays of itself, block by block. The audio thread owns it.
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
    /// Mean squares of the input and of both ears by band.
    input: f32,
    ears: [f32; BANDS],
    /// By ear what is below each edge.
    below: [[f32; BANDS - 1]; 2],
    /// Power from the input to the ears by band when it was last heard, and the listener's distance then, metres.
    gains: [f32; BANDS],
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
        Self {
            account,
            task: None,
            now: Grant::FULL,
            level: 1.0,
            taken: 0,
            settled: 0,
            waited: false,
            input: 0.0,
            ears: [0.0; BANDS],
            below: [[0.0; BANDS - 1]; 2],
            gains: [1.0 / BANDS as f32; BANDS],
            gain_at_m: 1.0,
            limited: false,
            power: 0.0,
            quiet: true,
        }
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

    /// Chooses whether a block is played whose inputs have a mean square of `power`. An instance that leads others or is
    /// bypassed does not wait; offline there is no budget. Returns what measures the block's time, where there is a limit.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O. Wakes a thread when a sound begins.
    pub(crate) fn begin(&mut self, power: impl FnOnce() -> f32, offline: bool, is_needed: bool) -> Option<StopWatch> {
        self.limited = limit_percent().is_some() && !offline;
        let held = if self.limited { self.account.held() } else { Grant::FULL };
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
        self.now = if is_needed { held.max(Grant::LEAST) } else { held };
        self.limited.then(StopWatch::start)
    }

    /// Whether nothing has to be rendered: it waits, and what was heard has faded out.
    pub(crate) fn waits(&mut self) -> bool {
        self.waited |= self.now == Grant::WAITS && self.level == 0.0;
        self.waited && self.now == Grant::WAITS
    }

    /// Whether it has waited and is to begin anew with this block, at a latency in samples.
    pub(crate) fn wakes(&mut self, latency: usize, sample_rate_hz: f64) -> bool {
        let wakes = self.now != Grant::WAITS && self.waited;
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
        let target = if self.now == Grant::WAITS { 0.0 } else { 1.0 };
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

    /// Measures a block for the allocator: its time, both ears, the distance to the emitter, metres, the accuracy that the user
    /// has set, and the length of the sound, seconds.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn end(&mut self, watch: &StopWatch, ears: [&[f32]; 2], away_m: f32, most: AccuracyChoice, length_s: f64) {
        let took = watch.elapsed();
        let (length, length_s) = (narrow(length_s), length_s.max(1e-9));
        follow(&mut self.input, self.power, length);
        let found = self.band_powers(ears, length);
        self.ears.iter_mut().zip(found).for_each(|(level, found)| follow(level, found, length));
        let away_m = away_m.max(promenade_core::NEAREST_M);
        let waits = self.now == Grant::WAITS;
        if !waits && self.level == 1.0 && self.taken >= self.settled && self.input > SILENCE && self.ears != [0.0; BANDS] {
            (self.gains, self.gain_at_m) = (self.ears.map(|power| power / self.input), away_m);
        }
        let nearer = (self.gain_at_m / away_m).powi(2);
        let expected = |band: usize| self.input * self.gains[band] * nearer;
        self.account.note(std::array::from_fn(|band| expected(band).max(if waits { 0.0 } else { self.ears[band] })), most);
        // A silent source costs next to nothing: that is not what its scene takes.
        if self.input > SILENCE && !waits {
            self.account.note_cost(narrow(took.as_secs_f64() / length_s), length / COST_S);
        }
    }

    /// Mean squares of both ears by band, over a block of some seconds.
    fn band_powers(&mut self, ears: [&[f32]; 2], length_s: f32) -> [f32; BANDS] {
        let len = ears[0].len().max(1) as f32;
        let follows = EDGES_HZ.map(|hz| 1.0 - (-std::f32::consts::TAU * hz * length_s / len).exp());
        let mut sums = [0.0; BANDS];
        for (ear, below) in ears.into_iter().zip(&mut self.below) {
            for x in ear {
                let mut last = 0.0;
                for ((below, follow), sum) in below.iter_mut().zip(follows).zip(&mut sums) {
                    *below += follow * (x - *below);
                    *sum += (*below - last).powi(2);
                    last = *below;
                }
                sums[BANDS - 1] += (x - last).powi(2);
            }
            // What is no number, or too small for one, is forgotten.
            below.iter_mut().filter(|below| !below.is_normal()).for_each(|below| *below = 0.0);
        }
        sums.map(|sum| if sum.is_finite() { 0.5 * sum / len } else { 0.0 })
    }
}

/// Length of a fade, samples, at least one.
fn fade_samples(sample_rate_hz: f64) -> usize {
    index(FADE_S * narrow(sample_rate_hz)).max(1)
}

/// Follows a mean square: up at once, down over [`LEVEL_S`].
fn follow(level: &mut f32, found: f32, length_s: f32) {
    *level = found.max(*level * (-length_s / LEVEL_S).exp());
    if *level < SILENCE {
        *level = 0.0;
    }
}
