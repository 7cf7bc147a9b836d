//! The descent of a full fit: legs of rounds of steps.

use super::fit::FullFit;
use super::schedule::{BEHIND_S, FullOptions, LOWEST_HZ, Leg};
use crate::bands::{BANDS, octave_energies_db};
use crate::early::{Chain, Compared, EarlyModel, Geometry, Iterate, Prior};
use crate::error::FitError;
use crate::late::{LateTie, Slopes};
use crate::measurements::Clock;
use crate::numerics::{Adam, Random};
use crate::room::{FlatRoom, Form};
use crate::search::{Scanned, near_box, scan};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::signal;
use rayon::prelude::*;

/// Steps of a round.
const STEPS: usize = 25;
/// Responses in a step at most.
const BATCH: usize = 12;
/// Rates: of logits, of nepers of the source, of metres, and of milliseconds.
pub(super) const RATES: [f64; 4] = [0.1, 0.03, 0.002, 0.006];
/// Squares of distances between waves over what is expected, below which they agree. Waves that have nothing to do with each
/// other are some hundred off.
const AGREE: f64 = 3.0;

/// What is found so far.
pub(super) struct State {
    /// Rounds that are done.
    round: usize,
    pub(super) x: Vec<f64>,
    adam: Adam,
    /// The chain's spectrum.
    pub(super) chain: Vec<Complex64>,
    pub(super) scanned: Vec<Scanned>,
}

/// A fit on its way.
pub(super) struct Descent<'a> {
    pub(super) model: EarlyModel<'a>,
    pub(super) prior: Prior,
    pub(super) options: &'a FullOptions,
    pub(super) chain: Chain,
}

impl Descent<'_> {
    pub(super) fn run(&self, room: &FlatRoom, each: &mut dyn FnMut(f64)) -> Result<FullFit, FitError> {
        let mut state = self.begin(room);
        let legs = self.options.legs(self.model.set, self.model.u.nodes);
        let rounds: Vec<(usize, usize)> =
            legs.iter().enumerate().flat_map(|(l, leg)| (0..leg.rounds).map(move |r| (l, r))).collect();
        let base = self.scanned(room, &state.scanned)?;
        let tie = self.tie(&base)?;
        for (done, (leg, round)) in rounds.iter().enumerate() {
            if state.round > done {
                continue;
            }
            // Where times are not known to a wave's length, waves would be taken for ones that are weaker.
            let compared = match legs[*leg].what {
                Compared::Magnitudes => (0..self.model.u.places).collect(),
                Compared::Waves => self.agreeing(&base, &tie, &state, legs[*leg].top_hz)?,
            };
            if compared.is_empty() {
                state.round = done + legs[*leg].rounds - round;
                continue;
            }
            self.round(&base, &tie, (&legs[*leg], *round), &compared, &mut state)?;
            state.round = done + 1;
            each(state.round as f64 / (rounds.len() + 1) as f64);
        }
        self.result(&base, &tie, &state)
    }

    /// The responses that agree with the model wave by wave up to a frequency; none of them if those are not the most.
    pub(super) fn agreeing(&self, base: &FlatRoom, tie: &LateTie, state: &State, top_hz: f64) -> Result<Vec<usize>, FitError> {
        let geometry = &self.geometry(base, state)?;
        let stage = &self.model.stage(Compared::Waves, (LOWEST_HZ, top_hz));
        let early = tie.early(self.options.window_s + BEHIND_S);
        let diffuse = &tie.diffuse(&self.model, &state.x, &early, false);
        let all = self.model.agreement(&Iterate { x: &state.x, geometry, stage, diffuse });
        let near: Vec<usize> = (0..all.len()).filter(|i| all[*i] < AGREE).collect();
        Ok(if 3 * near.len() >= 2 * all.len() { near } else { Vec::new() })
    }

    fn begin(&self, room: &FlatRoom) -> State {
        let x = self.model.start(&self.prior.mean, &self.chain);
        let scanned = match (&room.form, self.options.geometry) {
            (_, false) => Vec::new(),
            (Form::Box(walls), true) => near_box(&self.model, walls, &self.chain).to_vec(),
            (Form::Mesh(_), true) => scan(&self.model, room, &self.chain),
        };
        State { round: 0, adam: Adam::new(x.len()), x, chain: self.model.chain_spectrum(&self.chain), scanned }
    }

    /// The room with its walls where the scan found them.
    fn scanned(&self, room: &FlatRoom, scanned: &[Scanned]) -> Result<FlatRoom, FitError> {
        if scanned.is_empty() {
            return Ok(room.clone());
        }
        room.moved(&scanned.iter().map(|s| s.moved_m).collect::<Vec<f64>>())
    }

    fn tie(&self, base: &FlatRoom) -> Result<LateTie, FitError> {
        LateTie::new(base, self.model.set, &self.model.bands, self.options.order, self.options.seed)
    }

    /// The room and the chain as they are.
    pub(super) fn geometry(&self, base: &FlatRoom, state: &State) -> Result<Geometry, FitError> {
        let u = &self.model.u;
        let moved = base.moved(&state.x[u.wall(0)..u.wall(u.walls)])?;
        let places: Vec<_> = (0..u.places).filter_map(|i| self.model.places(&state.x, i)).collect();
        let sequences = moved.sequences(&places, self.options.order)?;
        Ok(Geometry::new(base.clone(), sequences, &state.chain))
    }

    /// The chain's energy by octave, dB.
    pub(super) fn chain_db(&self, chain: &[Complex64]) -> Vec<f64> {
        // What lies before the arrival comes at the end of the circle.
        let mut response: Vec<f32> = signal(chain.to_vec(), self.model.padded()).into_iter().map(|v| v as f32).collect();
        let turn = response.len() / 4;
        response.rotate_right(turn);
        octave_energies_db(&response, self.model.rate_hz)
    }

    /// Steps of a round over the responses that are `compared`.
    fn round(
        &self,
        base: &FlatRoom,
        tie: &LateTie,
        (leg, round): (&Leg, usize),
        compared: &[usize],
        state: &mut State,
    ) -> Result<(), FitError> {
        let mut geometry = self.geometry(base, state)?;
        let stage = self.model.stage(leg.what, (LOWEST_HZ, leg.top_hz));
        let early = tie.early(self.options.window_s + BEHIND_S);
        let mut diffuse = tie.diffuse(&self.model, &state.x, &early, true);
        if round < leg.chains {
            let renewed = self.model.renewed_chain(&state.x, &geometry);
            let next = Geometry::new(geometry.room.clone(), geometry.sequences.clone(), &renewed);
            // With places that are still wrong it would lose what does not add up in step.
            let left = |geometry: &Geometry| -> f64 {
                let at = Iterate { x: &state.x, geometry, stage: &stage, diffuse: &diffuse };
                let parts = (0..self.model.u.places).into_par_iter();
                parts.map(|i| self.model.response(&at, i).0).collect::<Vec<f64>>().iter().sum()
            };
            if left(&next) < left(&geometry) {
                state.chain = renewed;
                geometry = next;
            }
        }
        if round == 0 && leg.rescues {
            self.rescue(&mut state.x, &geometry, &diffuse, self.options.seed);
        }
        if round == 0 {
            state.adam = Adam::new(state.x.len());
        }
        let slopes = tie.slopes(&self.model, &state.x, &self.chain_db(&state.chain));
        let rates = self.rates(leg);
        for step in 0..STEPS {
            let number = (state.round * STEPS + step) as u64;
            let batch = Random::new(self.options.seed, number).batch(BATCH, compared.len());
            let at = Iterate { x: &state.x, geometry: &geometry, stage: &stage, diffuse: &diffuse };
            let (value, mut by) = self.model.mean_response(&at, batch.iter().map(|i| compared[*i]).collect());
            let left = if leg.what == Compared::Waves { 1.0 } else { value.max(0.02) };
            self.pull(tie, &slopes, &state.x, (left, leg.top_hz), &mut by);
            self.same_places(&mut by);
            // Rates become smaller along a leg.
            let gone = (round * STEPS + step) as f64 / (leg.rounds * STEPS) as f64;
            let slow = leg.slows_to.powf(gone);
            let now: Vec<f64> = rates.iter().map(|r| r * slow * leg.slower).collect();
            state.adam.step(&mut state.x, &by, &now);
            diffuse.energies = tie.diffuse(&self.model, &state.x, &early, false).energies;
        }
        Ok(())
    }

    /// Adds what was known before and what rays say. The mean difference `left` of logarithms is that of so many independent
    /// numbers as half the samples of all windows, each with a Laplacian's spread; of waves it is 1.
    fn pull(&self, tie: &LateTie, slopes: &Slopes, x: &[f64], (left, top_hz): (f64, f64), by: &mut [f64]) {
        let weight = left / self.independent(top_hz);
        self.prior.add(x, weight, by);
        tie.add(slopes, &self.model, x, weight, by);
    }

    fn independent(&self, top_hz: f64) -> f64 {
        let band = (2.0 * top_hz / self.model.rate_hz).min(1.0);
        0.5 * band * (self.model.length * self.model.set.all.len()) as f64
    }

    fn rates(&self, leg: &Leg) -> Vec<f64> {
        let u = &self.model.u;
        let mut rates = vec![0.0; u.count()];
        let mut set = |range: std::ops::Range<usize>, rate: f64, free: bool| {
            rates[range].fill(if free { rate } else { 0.0 });
        };
        set(0..u.level(0), RATES[0], leg.free.surfaces);
        set(u.level(0)..u.node(0, 0), RATES[1], leg.free.surfaces);
        set(u.node(0, 0)..u.wall(0), RATES[1], leg.free.source);
        set(u.wall(0)..u.wall(u.walls), RATES[2], leg.free.walls);
        for (i, m) in self.model.set.all.iter().enumerate() {
            let at = u.place(i);
            set(at..at + 3, RATES[2], leg.free.places && m.source.sd_m > 0.0);
            set(at + 3..at + 6, RATES[2], leg.free.places && m.microphone.sd_m > 0.0);
            set(at + 6..at + 7, RATES[3], self.clock_is_free(i));
        }
        // Bands above what is compared stay.
        for (b, hz) in self.model.bands.centres_hz.iter().enumerate().filter(|(_, hz)| **hz > 1.5 * leg.top_hz) {
            debug_assert!(*hz > 0.0);
            (0..u.surfaces + 2 + u.nodes).for_each(|row| rates[row * BANDS + b] = 0.0);
        }
        rates
    }

    /// Whether a response has an offset of its own.
    pub(super) fn clock_is_free(&self, i: usize) -> bool {
        self.model.set.all[i].clock == Clock::Free || !self.chain.known
    }

    /// Gives all copies of one place the sum of their derivatives.
    fn same_places(&self, by: &mut [f64]) {
        let (u, all) = (&self.model.u, &self.model.set.all);
        for from in [0, 3] {
            let of = |i: usize| if from == 0 { all[i].source.at_m } else { all[i].microphone.at_m };
            for i in 0..all.len() {
                if (0..i).any(|j| of(j) == of(i)) {
                    continue;
                }
                let same: Vec<usize> = (i..all.len()).filter(|j| of(*j) == of(i)).collect();
                for a in from..from + 3 {
                    let sum: f64 = same.iter().map(|j| by[u.place(*j) + a]).sum();
                    same.iter().for_each(|j| by[u.place(*j) + a] = sum);
                }
            }
        }
    }
}
