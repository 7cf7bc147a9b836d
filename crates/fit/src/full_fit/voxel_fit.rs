//! What each piece of a surface absorbs, with everything else as the full fit has found it.
//!
//! Numbers sought are logits of absorption by piece and band. They are compared with the beginnings of responses as in the full
//! fit, and tied to the late part through their means over each surface. What is known before is a field about a mean: smooth
//! between neighbours and between bands, with edges where it must have them. The mean is what the whole surface was found to
//! absorb, or, with pictures, what the looks of a piece foretell from those of pieces that sound has met.

use crate::adam::Adam;
use crate::bands::{BANDS, PerBand};
use crate::early_model::{Around, Diffuse, EarlyModel, Stage, logistic};
use crate::energy_model::BIN_S;
use crate::error::FitError;
use crate::estimate::Estimate;
use crate::flat_room::voxels::Voxels;
use crate::flat_room::{FlatRoom, Way};
use crate::full_fit::FullFit;
use crate::guess::{Example, Guess};
use crate::late_tie::{LateTie, logit};
use crate::loss::Compared;
use crate::measurements::Measurements;
use crate::random::Random;
use crate::unknowns::{Unknowns, of_table};
use nalgebra::DMatrix;
use promenade_fourier::num_complex::Complex64;
use rayon::prelude::*;
use std::sync::Arc;

/// Steps before and after a guess is made, responses in a step at most, the first and last rate, and what those of a guess are
/// slower by.
const STEPS: usize = 60;
const BATCH: usize = 12;
const RATES: (f64, f64) = (0.15, 0.01);
const SLOWER: f64 = 0.2;
/// Frequencies that are compared, hertz, and the highest as a share of the sample rate.
const LOWEST_HZ: f64 = 90.0;
const HIGHEST: f64 = 0.46;
/// Seconds beyond the window of which diffuse sound is asked.
const BEHIND_S: f64 = 0.2;
/// How far a field reaches, metres.
const REACH_M: f64 = 1.0;
/// Steps beyond so many standard deviations pull no harder: edges.
const EDGE: f64 = 1.5;
/// Pieces about one that are asked how sure it is.
const LOCAL: usize = 60;
/// A number that is known less than this much better than before is not determined by the data.
const UNDETERMINED: f64 = 0.7;
/// Side of a place that is left out as one when guesses are learnt, metres.
const PART_M: f64 = 1.2;
/// Guesses are learnt where a number is known so much better than before: what is known less well is near to what was known
/// before, and would teach that.
const CLEAR: f64 = 0.55;
/// Least standard deviation of what is learnt from, of logits.
const LEARNT: f64 = 0.3;

/// What pieces of surfaces absorb.
#[derive(Clone, Debug, PartialEq)]
pub struct VoxelFit {
    /// The pieces.
    pub voxels: Arc<Voxels>,
    /// Absorption of each by band.
    pub absorption: Vec<[Estimate; BANDS]>,
    /// Whether a piece was guessed from pictures, since no sound that was heard tells of it.
    pub guessed: Vec<bool>,
    /// How far guesses from pictures are off where sound tells what is right, by band, as a share of absorption at the mean;
    /// none without pictures or where these foretell nothing.
    pub off: Option<PerBand>,
    /// Pieces that pictures show.
    pub shown: usize,
    /// Mean difference of logarithms that is left.
    pub left: f64,
}

impl VoxelFit {
    /// Whether sound that was heard tells of a piece: in half of the bands or more.
    #[must_use]
    pub fn is_touched(&self, patch: usize) -> bool {
        2 * self.absorption[patch].iter().filter(|e| e.determined).count() >= BANDS
    }

    /// Absorption of a surface: the mean over the area of its pieces.
    #[must_use]
    pub fn surface(&self, surface: usize) -> [Estimate; BANDS] {
        let own: Vec<usize> = (0..self.voxels.patches.len()).filter(|p| self.voxels.patches[*p].surface == surface).collect();
        let area: f64 = own.iter().map(|p| self.voxels.patches[*p].area_m2).sum();
        std::array::from_fn(|b| {
            let mean = |of: &dyn Fn(&Estimate) -> f64| -> f64 {
                own.iter().map(|p| self.voxels.patches[*p].area_m2 / area * of(&self.absorption[*p][b])).sum()
            };
            let determined = mean(&|e| f64::from(u8::from(e.determined))) > 0.5;
            Estimate { value: mean(&|e| e.value), error: mean(&|e| e.error), determined }
        })
    }
}

/// Materials of a surface at most, as it is written.
const MATERIALS: usize = 8;
/// Rounds in which pieces find the material that is nearest.
const SORTED: usize = 20;

impl VoxelFit {
    /// Sorts the pieces of each surface into at most eight materials that differ most (Lloyd 1982): of each piece the number
    /// within its surface, and of each surface the materials.
    pub(crate) fn materials(&self, surfaces: usize) -> (Vec<usize>, Vec<Vec<PerBand>>) {
        let value = |p: usize| -> PerBand { self.absorption[p].map(|e| logit(e.value)) };
        let far = |a: &PerBand, b: &PerBand| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let (mut of, mut all) = (vec![0; self.absorption.len()], vec![Vec::new(); surfaces]);
        for (s, found) in all.iter_mut().enumerate() {
            let own: Vec<usize> = (0..of.len()).filter(|p| self.voxels.patches[*p].surface == s).collect();
            let Some(first) = own.first() else { continue };
            // Begins with pieces that are as far from each other as can be.
            let mut middles = vec![value(*first)];
            while middles.len() < MATERIALS.min(own.len()) {
                let apart = |p: &usize| middles.iter().map(|m| far(m, &value(*p))).fold(f64::INFINITY, f64::min);
                let Some(next) = own.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))) else { break };
                let next = value(*next);
                middles.push(next);
            }
            for _ in 0..SORTED {
                for p in &own {
                    let to = |m: &usize| far(&middles[*m], &value(*p));
                    of[*p] = (0..middles.len()).min_by(|a, b| to(a).total_cmp(&to(b))).unwrap_or(0);
                }
                for (m, middle) in middles.iter_mut().enumerate() {
                    let area = |p: &&usize| self.voxels.patches[**p].area_m2;
                    let sum: f64 = own.iter().filter(|p| of[**p] == m).map(|p| area(&p)).sum();
                    if sum > 0.0 {
                        let mean = |b: usize| -> f64 {
                            own.iter().filter(|p| of[**p] == m).map(|p| area(&p) / sum * self.absorption[*p][b].value).sum()
                        };
                        *middle = std::array::from_fn(|b| logit(mean(b)));
                    }
                }
            }
            *found = middles.into_iter().map(|m| m.map(logistic)).collect();
        }
        (of, all)
    }
}

/// What is known of the pieces before sound is asked: means and standard deviations of logits.
struct Field {
    mean: Vec<PerBand>,
    sd: Vec<PerBand>,
    /// Standard deviation of a step to the next band.
    step: f64,
    /// Of a step between neighbours, over the field's.
    rough: f64,
    /// Precision of a piece alone over that of a step.
    alone: f64,
}

/// What a guess says of pieces that pictures show.
struct Learnt<'a> {
    guess: Guess,
    looks: &'a [Option<Vec<f64>>],
    /// What the whole surface of each piece absorbs.
    whole: Vec<PerBand>,
    /// What the guess counts beside that, by band.
    shares: PerBand,
}

impl Learnt<'_> {
    /// Means of pieces.
    fn means(&self) -> Vec<PerBand> {
        let one = |(look, whole): (&Option<Vec<f64>>, &PerBand)| match look {
            Some(look) => {
                let (found, _) = self.guess.of(look);
                std::array::from_fn(|b| self.shares[b] * found[b] + (1.0 - self.shares[b]) * whole[b])
            }
            None => *whole,
        };
        self.looks.iter().zip(&self.whole).map(one).collect()
    }

    /// Moves the guess against derivatives by all numbers.
    fn step(&mut self, by: &[f64], weight: f64, rate: f64) {
        let one = |(p, look): (usize, &'_ Option<Vec<f64>>)| -> Option<(usize, PerBand)> {
            look.as_ref().map(|_| (p, std::array::from_fn(|b| self.shares[b] * by[p * BANDS + b])))
        };
        let by: Vec<(usize, PerBand)> = self.looks.iter().enumerate().filter_map(one).collect();
        let by: Vec<(&[f64], PerBand)> = by.iter().filter_map(|(p, by)| Some((self.looks[*p].as_deref()?, *by))).collect();
        self.guess.step(&by, weight, rate);
    }
}

impl Field {
    /// Derivatives of half the sum of squares, times a weight.
    fn add(&self, voxels: &Voxels, x: &[f64], weight: f64, by: &mut [f64]) {
        let off = |p: usize, b: usize| x[p * BANDS + b] - self.mean[p][b];
        for p in 0..voxels.patches.len() {
            for b in 0..BANDS {
                let step = self.rough * self.sd[p][b];
                by[p * BANDS + b] += weight * self.alone * off(p, b) / step.powi(2);
                if b > 0 {
                    let pull = weight * ((off(p, b) - off(p, b - 1)) / self.step).clamp(-EDGE, EDGE) / self.step;
                    // A piece alone has little to say of the field's form over frequency.
                    by[p * BANDS + b] += self.alone * pull;
                    by[p * BANDS + b - 1] -= self.alone * pull;
                }
            }
        }
        for pair in &voxels.neighbours {
            let [i, j] = pair.map(|p| p as usize);
            for b in 0..BANDS {
                let step = self.rough * (self.sd[i][b] * self.sd[j][b]).sqrt();
                let pull = weight * ((off(j, b) - off(i, b)) / step).clamp(-EDGE, EDGE) / step;
                by[j * BANDS + b] += pull;
                by[i * BANDS + b] -= pull;
            }
        }
    }
}

/// A fit on its way.
struct Pieces<'a> {
    voxels: Arc<Voxels>,
    room: FlatRoom,
    /// Pieces instead of surfaces.
    model: EarlyModel<'a>,
    /// Surfaces as they were.
    whole: EarlyModel<'a>,
    tie: LateTie,
    around: Around,
    stage: Stage,
    diffuse: Diffuse,
    chain_db: Vec<f64>,
    /// All numbers of `whole`.
    of_whole: Vec<f64>,
    seed: u64,
}

/// Features of each piece of a room's surfaces, none for those that no picture shows.
type Looks<'a> = &'a mut dyn FnMut(&FlatRoom, &Voxels) -> Result<Vec<Option<Vec<f64>>>, FitError>;

impl FullFit {
    /// The same with a number for each piece of a surface that lies in one voxel of an edge of at most `edge_m`. `looks` are
    /// features of each piece, as many for each that is shown by a picture, and none of those that are not. `each` is told the
    /// share of the work that is done.
    ///
    /// # Errors
    /// As [`Voxels::new`]; features that are not as many as pieces, or not as many for each.
    pub fn in_voxels(
        &self,
        set: &Measurements,
        edge_m: f64,
        seed: u64,
        looks: Looks<'_>,
        each: &mut dyn FnMut(f64),
    ) -> Result<Self, FitError> {
        let room = self.room.in_voxels(edge_m)?;
        let Some(voxels) = room.voxels.clone() else { return Ok(self.clone()) };
        let looks = looks(&room, &voxels)?;
        let count = looks.iter().flatten().next().map_or(0, Vec::len);
        if looks.len() != voxels.patches.len() || looks.iter().flatten().any(|l| l.len() != count) {
            let found = format!("{} of pieces, {count} features of the first", looks.len());
            return Err(FitError::argument("looks", format!("as many for each of {} pieces", voxels.patches.len()), found));
        }
        let found = Pieces::new(self, set, room.clone(), Arc::clone(&voxels), seed)?.run(self, &looks, each);
        let mut fit = self.clone();
        for (s, surface) in fit.surfaces.iter_mut().enumerate() {
            surface.absorption = found.surface(s);
        }
        fit.left = found.left;
        (fit.room, fit.voxels) = (room, Some(found));
        Ok(fit.with_residual(set))
    }
}

impl<'a> Pieces<'a> {
    fn new(fit: &'a FullFit, set: &'a Measurements, room: FlatRoom, voxels: Arc<Voxels>, seed: u64) -> Result<Self, FitError> {
        let u = |surfaces: usize| Unknowns { surfaces, nodes: fit.sent.len(), walls: room.walls.len(), places: set.all.len() };
        let model = EarlyModel::new(u(voxels.patches.len()), set, &fit.chain, fit.order, fit.window_s);
        let whole = EarlyModel::new(u(room.surfaces.len()), set, &fit.chain, fit.order, fit.window_s);
        let of_whole = fit.numbers(&whole);
        let tie = LateTie::new(&room, set, &fit.bands, fit.order, seed)?;
        let places: Vec<([f64; 3], [f64; 3])> = (0..set.all.len()).filter_map(|i| whole.places(&of_whole, i)).collect();
        let spectrum: Vec<Complex64> = model.chain_spectrum(&fit.chain);
        let around = Around::new(room.clone(), room.sequences(&places, fit.order)?, &spectrum);
        let what = if fit.waves { Compared::Waves } else { Compared::Magnitudes };
        let stage = model.stage(what, (LOWEST_HZ, HIGHEST * model.rate_hz));
        let diffuse = tie.diffuse(&whole, &of_whole, &tie.early(fit.window_s + BEHIND_S), false);
        let chain_db = fit.chain_db(model.rate_hz);
        debug_assert_eq!(diffuse.bin_s, BIN_S);
        Ok(Self { voxels, room, model, whole, tie, around, stage, diffuse, chain_db, of_whole, seed })
    }

    fn run(&self, fit: &FullFit, looks: &[Option<Vec<f64>>], each: &mut dyn FnMut(f64)) -> VoxelFit {
        let patches = self.voxels.patches.len();
        let (_, table, octave) = of_table();
        let table = fit.bands.from_octaves(&std::array::from_fn::<f64, 8, _>(|o| table[o.saturating_sub(1)]));
        let octaves = (fit.bands.centres_hz[BANDS - 1] / fit.bands.centres_hz[0]).log2() / (BANDS - 1) as f64;
        let whole = |p: usize| -> PerBand {
            let s = self.voxels.patches[p].surface;
            std::array::from_fn(|b| self.of_whole[s * BANDS + b])
        };
        // A field of steps between neighbours and pieces alone (Rue and Held 2005, section 3.3).
        let alone = (self.voxels.edge_m / REACH_M).powi(2);
        let rough = (4.0 * std::f64::consts::PI / (1.0 + 8.0 / alone).ln()).sqrt();
        let step = octave * octaves.sqrt();
        let mut field = Field { mean: (0..patches).map(whole).collect(), sd: vec![table; patches], step, rough, alone };
        // All numbers of the pieces, and after them those of the whole that stay.
        let mut x: Vec<f64> = field.mean.iter().flatten().copied().collect();
        x.extend(&self.of_whole[self.whole.u.scattering(0)..]);
        let shown = looks.iter().flatten().count();
        let part = if shown > 0 { 0.45 } else { 0.9 };
        self.descend(&mut field, &mut x, None, &[], &mut |share| each(part * share));
        let mut learnt = None;
        if shown > 0 {
            let errors = self.errors(&x, &field, &field.sd);
            if let Some(guess) = self.learnt(looks, &x, &errors, &table) {
                // Bands of which too little is known to judge guesses follow the others.
                let sd: PerBand = std::array::from_fn(|b| guess.off[b].min(table[b]));
                let shares = std::array::from_fn(|b| sd[b].powi(-2) / (sd[b].powi(-2) + table[b].powi(-2)));
                let mut own = Learnt { guess, looks, whole: field.mean.clone(), shares };
                field.mean = own.means();
                let mut held = vec![false; patches * BANDS];
                for (p, look) in looks.iter().enumerate() {
                    let Some(look) = look else { continue };
                    field.sd[p] = std::array::from_fn(|b| (sd[b].powi(-2) + table[b].powi(-2)).sqrt().recip());
                    let other = own.guess.without(look, self.part(p));
                    for b in 0..BANDS {
                        let (error, told) = errors[p][b];
                        let number = p * BANDS + b;
                        held[number] = told;
                        // What sound tells of counts by its standard error, beside a guess that has not seen it; what it says
                        // nothing of begins at the guess.
                        let mean =
                            if told { shares[b] * other[b] + (1.0 - shares[b]) * own.whole[p][b] } else { field.mean[p][b] };
                        let trust = if told { error.powi(2) / (error.powi(2) + sd[b].powi(2)) } else { 1.0 };
                        x[number] += trust * (mean - x[number]);
                    }
                }
                self.descend(&mut field, &mut x, Some(&mut own), &held, &mut |share| each(part * (1.0 + share)));
                learnt = Some(own.guess);
            }
        }
        self.result(&x, &field, &table, learnt.as_ref(), looks, shown)
    }

    /// Steps about a field; numbers that are `held` stay.
    fn descend(
        &self,
        field: &mut Field,
        x: &mut [f64],
        mut learnt: Option<&mut Learnt<'_>>,
        held: &[bool],
        each: &mut dyn FnMut(f64),
    ) {
        let hold = |by: &mut [f64]| by.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(by, _)| *by = 0.0);
        let places = self.model.u.places;
        let numbers = self.voxels.patches.len() * BANDS;
        let slopes = self.tie.slopes(&self.whole, &self.means(x), &self.chain_db);
        let mut adam = Adam::new(numbers);
        for step in 0..STEPS {
            let batch: Vec<usize> = if places <= BATCH {
                (0..places).collect()
            } else {
                Random::new(self.seed, 0x766F_7800 + step as u64).choose(BATCH, places)
            };
            let parts: Vec<(f64, Vec<f64>)> = batch.par_iter().map(|i| self.response(x, *i)).collect();
            let share = 1.0 / batch.len() as f64;
            let mut by = vec![0.0; numbers];
            let mut value = 0.0;
            for (own, grown) in &parts {
                value += share * own;
                by.iter_mut().zip(grown).for_each(|(b, g)| *b += share * g);
            }
            let weight = self.left(value) / self.independent();
            let means = self.means(x);
            let mut by_means = vec![0.0; means.len()];
            self.tie.add(&slopes, &self.whole, &means, weight, &mut by_means);
            self.by_pieces(x, &means, &by_means, &mut by);
            let rate = RATES.0 * (RATES.1 / RATES.0).powf(step as f64 / STEPS as f64);
            hold(&mut by);
            if let Some(learnt) = &mut learnt {
                learnt.step(&by, weight, SLOWER * rate);
            }
            field.add(&self.voxels, x, weight, &mut by);
            hold(&mut by);
            adam.step(&mut x[..numbers], &by, &vec![rate; numbers]);
            if let Some(learnt) = &learnt {
                // Numbers move with their means.
                for (p, (own, mean)) in learnt.means().into_iter().zip(&mut field.mean).enumerate() {
                    for b in (0..BANDS).filter(|b| !held[p * BANDS + b]) {
                        x[p * BANDS + b] += own[b] - mean[b];
                    }
                    *mean = own;
                }
            }
            each((step + 1) as f64 / STEPS as f64);
        }
    }

    fn response(&self, x: &[f64], i: usize) -> (f64, Vec<f64>) {
        self.model.response(x, &self.around, &self.stage, &self.diffuse, i)
    }

    /// What a mean difference weighs against what is known: see the full fit.
    fn left(&self, value: f64) -> f64 {
        if self.stage.what == Compared::Waves { 1.0 } else { value.max(0.02) }
    }

    fn independent(&self) -> f64 {
        0.5 * 2.0 * HIGHEST * (self.model.length * self.model.u.places) as f64
    }

    /// Numbers of the whole with means of the pieces.
    fn means(&self, x: &[f64]) -> Vec<f64> {
        let mut sums = vec![[0.0; BANDS]; self.room.surfaces.len()];
        let areas = self.room.areas_m2();
        for (p, patch) in self.voxels.patches.iter().enumerate() {
            for (b, sum) in sums[patch.surface].iter_mut().enumerate() {
                *sum += patch.area_m2 / areas[patch.surface] * logistic(x[p * BANDS + b]);
            }
        }
        let mut means = self.of_whole.clone();
        for (s, sum) in sums.iter().enumerate().filter(|(s, _)| areas[*s] > 0.0) {
            (0..BANDS).for_each(|b| means[s * BANDS + b] = logit(sum[b]));
        }
        means
    }

    /// Derivatives by pieces from those by means.
    fn by_pieces(&self, x: &[f64], means: &[f64], by_means: &[f64], by: &mut [f64]) {
        let areas = self.room.areas_m2();
        let slope = |l: f64| (logistic(l) * (1.0 - logistic(l))).max(1e-4);
        for (p, patch) in self.voxels.patches.iter().enumerate() {
            for b in 0..BANDS {
                let s = patch.surface * BANDS + b;
                let share = patch.area_m2 / areas[patch.surface].max(1e-9);
                by[p * BANDS + b] += by_means[s] * share * slope(x[p * BANDS + b]) / slope(means[s]);
            }
        }
    }

    /// Standard errors of logits by piece and band, and whether sound tells of them.
    ///
    /// What a way says of its pieces together is taken apart as if those beside one were known no better than before; pieces
    /// about one and the field between them then say how sure it is.
    fn errors(&self, x: &[f64], field: &Field, sd: &[PerBand]) -> Vec<[(f64, bool); BANDS]> {
        let value = (0..self.model.u.places).into_par_iter().map(|i| self.response(x, i).0).sum::<f64>();
        let left = self.left(value / self.model.u.places as f64);
        let all: Vec<Vec<(Way, PerBand)>> = (0..self.model.u.places)
            .into_par_iter()
            .map(|i| self.model.told_by_ways(x, &self.around, &self.stage, &self.diffuse, i, left))
            .collect();
        let mut told = vec![[0.0; BANDS]; self.voxels.patches.len()];
        for (way, own) in all.iter().flatten() {
            for b in 0..BANDS {
                let grown = |(p, n): &(u16, f64)| {
                    let p = usize::from(*p);
                    (0.5 * n * logistic(x[p * BANDS + b])).powi(2) * sd[p][b].powi(2)
                };
                let sum: f64 = way.hits.iter().map(grown).sum();
                for hit in &way.hits {
                    let mine = grown(hit);
                    let p = usize::from(hit.0);
                    told[p][b] += mine / sd[p][b].powi(2) / (own[b].max(1e-12).recip() + sum - mine);
                }
            }
        }
        (0..told.len()).into_par_iter().map(|p| self.local(p, &told, field, sd)).collect()
    }

    fn local(&self, patch: usize, told: &[PerBand], field: &Field, sd: &[PerBand]) -> [(f64, bool); BANDS] {
        let mut near = self.voxels.around(patch, LOCAL);
        near.sort_unstable();
        let place = |p: u32| near.binary_search(&p).ok();
        let pairs: Vec<[usize; 2]> =
            self.voxels.neighbours.iter().filter_map(|[i, j]| Some([place(*i)?, place(*j)?])).collect();
        let own = place(patch as u32).unwrap_or(0);
        std::array::from_fn(|b| {
            let step = (field.rough * sd[patch][b]).powi(-2);
            let mut before = DMatrix::<f64>::zeros(near.len(), near.len());
            (0..near.len()).for_each(|k| before[(k, k)] = field.alone * step);
            for [i, j] in &pairs {
                before[(*i, *i)] += step;
                before[(*j, *j)] += step;
                before[(*i, *j)] -= step;
                before[(*j, *i)] -= step;
            }
            let mut after = before.clone();
            near.iter().enumerate().for_each(|(k, p)| after[(k, k)] += told[*p as usize][b]);
            let variance = |of: DMatrix<f64>| {
                let mut unit = nalgebra::DVector::<f64>::zeros(near.len());
                unit[own] = 1.0;
                of.cholesky().map_or(f64::INFINITY, |c| c.solve(&unit)[own])
            };
            let share = (variance(after) / variance(before)).sqrt();
            (sd[patch][b] * share, share < UNDETERMINED)
        })
    }

    /// The place of a piece that is left out as one.
    fn part(&self, piece: usize) -> u64 {
        let patch = &self.voxels.patches[piece];
        let cell = |a: usize| ((patch.centre_m[a] / PART_M).floor() as i64).cast_unsigned() & 0xFFFF;
        (patch.wall as u64) << 48 | cell(0) << 32 | cell(1) << 16 | cell(2)
    }

    /// Guesses from the looks of pieces that sound tells of.
    fn learnt(&self, looks: &[Option<Vec<f64>>], x: &[f64], errors: &[[(f64, bool); BANDS]], table: &PerBand) -> Option<Guess> {
        let examples: Vec<Example<'_>> = looks
            .iter()
            .enumerate()
            .filter_map(|(p, look)| {
                let weight: PerBand = std::array::from_fn(|b| {
                    let (error, _) = errors[p][b];
                    if error < CLEAR * table[b] { table[b].powi(2) / (error.powi(2) + LEARNT.powi(2)) } else { 0.0 }
                });
                let value = std::array::from_fn(|b| x[p * BANDS + b]);
                let some = weight.iter().any(|w| *w > 0.0);
                look.as_ref().filter(|_| some).map(|features| Example { features, value, weight, part: self.part(p) })
            })
            .collect();
        Guess::learn(&examples, self.seed)
    }

    fn result(
        &self,
        x: &[f64],
        field: &Field,
        table: &PerBand,
        guess: Option<&Guess>,
        looks: &[Option<Vec<f64>>],
        shown: usize,
    ) -> VoxelFit {
        let (told, known) = (self.errors(x, field, &vec![*table; looks.len()]), self.errors(x, field, &field.sd));
        let estimate = |p: usize, b: usize| {
            let value = logistic(x[p * BANDS + b]);
            Estimate { value, error: known[p][b].0 * value * (1.0 - value), determined: told[p][b].1 }
        };
        let places = self.model.u.places;
        let stage = self.model.stage(Compared::Magnitudes, (LOWEST_HZ, HIGHEST * self.model.rate_hz));
        let each = |i| self.model.response(x, &self.around, &stage, &self.diffuse, i).0;
        let left = (0..places).into_par_iter().map(each).sum::<f64>() / places as f64;
        let mean = |b: usize| (0..looks.len()).map(|p| estimate(p, b).value).sum::<f64>() / looks.len() as f64;
        let mut found = VoxelFit {
            voxels: Arc::clone(&self.voxels),
            absorption: (0..looks.len()).map(|p| std::array::from_fn(|b| estimate(p, b))).collect(),
            guessed: Vec::new(),
            off: guess.map(|g| std::array::from_fn(|b| g.off[b].min(table[b]) * mean(b) * (1.0 - mean(b)))),
            shown,
            left,
        };
        found.guessed =
            looks.iter().enumerate().map(|(p, look)| guess.is_some() && look.is_some() && !found.is_touched(p)).collect();
        found
    }
}
