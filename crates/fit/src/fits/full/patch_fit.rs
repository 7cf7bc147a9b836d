//! What each patch of a surface absorbs, with everything else as the full fit has found it.
//!
//! Numbers sought are logits of absorption by patch and band. They are compared with the beginnings of responses as in the full
//! fit, and tied to the late part through their means over each surface. What is known before is a field about a mean: smooth
//! between neighbours and between bands, with edges where it must have them. The mean is what the whole surface was found to
//! absorb, or, with pictures, what the appearance of a patch predicts from those of patches that sound has met.

use super::appearance_prior::{AppearancePrior, learn, part};
use super::field::Field;
use super::fit::FullFit;
use super::patches::VoxelFit;
use super::schedule::{BEHIND_S, HIGHEST, LOWEST_HZ};
use crate::appearance::Regressor;
use crate::bands::{BANDS, Estimate, PerBand, logistic, logit};
use crate::early::{Compared, Diffuse, EarlyModel, Geometry, Iterate, Stage, Unknowns, of_table};
use crate::error::FitError;
use crate::late::LateTie;
use crate::measurements::Measurements;
use crate::numerics::{Adam, Random};
use crate::room::{FlatRoom, Voxels};
use promenade_fourier::num_complex::Complex64;
use rayon::prelude::*;
use std::sync::Arc;

/// Steps before and after appearance is learnt, responses in a step at most, the first and last rate, and what those of the
/// regressor are slower by.
const STEPS: usize = 60;
const BATCH: usize = 12;
const RATES: (f64, f64) = (0.15, 0.01);
const SLOWER: f64 = 0.2;
/// How far a field reaches, metres.
const REACH_M: f64 = 1.0;
/// A fit on its way.
pub(super) struct PatchFitter<'a> {
    pub(super) voxels: Arc<Voxels>,
    /// Features of each patch; none of those that no picture shows.
    features: &'a [Option<Vec<f64>>],
    /// Standard deviation of logits over the table of materials.
    table: PerBand,
    room: FlatRoom,
    /// Patches instead of surfaces.
    pub(super) model: EarlyModel<'a>,
    /// Surfaces as they were.
    whole: EarlyModel<'a>,
    tie: LateTie,
    geometry: Geometry,
    stage: Stage,
    diffuse: Diffuse,
    chain_db: Vec<f64>,
    /// All numbers of `whole`.
    of_whole: Vec<f64>,
    seed: u64,
}

/// Features of each patch of a room's surfaces, none for those that no picture shows.
type Features<'a> = &'a mut dyn FnMut(&FlatRoom, &Voxels) -> Result<Vec<Option<Vec<f64>>>, FitError>;

impl FullFit {
    /// This fit with a number for each patch of a surface that lies in one voxel of an edge of at most `edge_m`. `features` are
    /// asked for each patch: as many for each that is shown by a picture, and none of those that are not. `each` is told the
    /// share of the work that is done.
    ///
    /// # Errors
    /// Those of [`FlatRoom::in_voxels`]; features that are not as many as patches, or not as many for each.
    pub fn in_voxels(
        &self,
        set: &Measurements,
        edge_m: f64,
        seed: u64,
        features: Features<'_>,
        each: &mut dyn FnMut(f64),
    ) -> Result<Self, FitError> {
        let room = self.room.in_voxels(edge_m)?;
        let Some(voxels) = room.voxels.clone() else { return Ok(self.clone()) };
        let features = features(&room, &voxels)?;
        let count = features.iter().flatten().next().map_or(0, Vec::len);
        if features.len() != voxels.patches.len() || features.iter().flatten().any(|own| own.len() != count) {
            let found = format!("{} of patches, {count} features of the first", features.len());
            return Err(FitError::argument("features", format!("as many for each of {} patches", voxels.patches.len()), found));
        }
        let found = PatchFitter::new(self, set, (room.clone(), &voxels), &features, seed)?.run(self, each);
        let mut fit = self.clone();
        for (s, surface) in fit.surfaces.iter_mut().enumerate() {
            surface.absorption = found.surface(s);
        }
        fit.left = found.left;
        (fit.room, fit.voxels) = (room, Some(found));
        Ok(fit.with_residual(set))
    }
}

impl<'a> PatchFitter<'a> {
    fn new(
        fit: &'a FullFit,
        set: &'a Measurements,
        (room, voxels): (FlatRoom, &Arc<Voxels>),
        features: &'a [Option<Vec<f64>>],
        seed: u64,
    ) -> Result<Self, FitError> {
        let u = |surfaces: usize| Unknowns {
            surfaces,
            nodes: fit.node_levels.len(),
            walls: room.walls.len(),
            places: set.all.len(),
        };
        let model = EarlyModel::new(u(voxels.patches.len()), set, &fit.chain, fit.order, fit.window_s);
        let whole = EarlyModel::new(u(room.surfaces.len()), set, &fit.chain, fit.order, fit.window_s);
        let of_whole = fit.numbers(&whole);
        let tie = LateTie::new(&room, set, &fit.bands, fit.order, seed)?;
        let places: Vec<([f64; 3], [f64; 3])> = (0..set.all.len()).filter_map(|i| whole.places(&of_whole, i)).collect();
        let spectrum: Vec<Complex64> = model.chain_spectrum(&fit.chain);
        let geometry = Geometry::new(room.clone(), room.sequences(&places, fit.order)?, &spectrum);
        let what = if fit.waves { Compared::Waves } else { Compared::Magnitudes };
        let stage = model.stage(what, (LOWEST_HZ, HIGHEST * model.rate_hz));
        let diffuse = tie.diffuse(&whole, &of_whole, &tie.early(fit.window_s + BEHIND_S), false);
        let chain_db = fit.chain_db(model.rate_hz);
        let (voxels, table) = (Arc::clone(voxels), fit.bands.of_material_octaves(&of_table().1));
        Ok(Self { voxels, features, table, room, model, whole, tie, geometry, stage, diffuse, chain_db, of_whole, seed })
    }

    fn run(&self, fit: &FullFit, each: &mut dyn FnMut(f64)) -> VoxelFit {
        let patches = self.voxels.patches.len();
        let whole = |p: usize| -> PerBand {
            let s = self.voxels.patches[p].surface;
            std::array::from_fn(|b| self.of_whole[s * BANDS + b])
        };
        // A field of steps between neighbours and patches alone (Rue and Held 2005, section 3.3).
        let alone = (self.voxels.edge_m / REACH_M).powi(2);
        let rough = (4.0 * std::f64::consts::PI / (1.0 + 8.0 / alone).ln()).sqrt();
        let step = of_table().2 * fit.bands.octaves_apart().sqrt();
        let mut field = Field { mean: (0..patches).map(whole).collect(), sd: vec![self.table; patches], step, rough, alone };
        // All numbers of the patches, and after them those of the whole that stay.
        let mut x: Vec<f64> = field.mean.iter().flatten().copied().collect();
        x.extend(&self.of_whole[self.whole.u.scattering(0)..]);
        let shown = self.features.iter().any(Option::is_some);
        let part = if shown { 0.45 } else { 0.9 };
        self.descend(&mut field, &mut x, None, &[], &mut |share| each(part * share));
        let errors = if shown { self.errors(&x, &field, &field.sd) } else { Vec::new() };
        let learnt = learn((&self.voxels.patches, self.features), &x, &errors, &self.table, self.seed);
        let regressor = learnt.map(|regressor| {
            let (mut own, held) = self.with_appearance(regressor, &errors, &mut field, &mut x);
            self.descend(&mut field, &mut x, Some(&mut own), &held, &mut |share| each(part * (1.0 + share)));
            own.regressor
        });
        self.result(&x, &field, regressor.as_ref())
    }

    /// Moves a field and numbers to what appearance says; tells which numbers sound tells of.
    fn with_appearance(
        &self,
        regressor: Regressor,
        errors: &[[(f64, bool); BANDS]],
        field: &mut Field,
        x: &mut [f64],
    ) -> (AppearancePrior<'a>, Vec<bool>) {
        // Bands of which too little is known to judge predictions follow the others.
        let (table, patches) = (&self.table, &self.voxels.patches);
        let sd: PerBand = std::array::from_fn(|b| regressor.off[b].min(table[b]));
        let shares = std::array::from_fn(|b| sd[b].powi(-2) / (sd[b].powi(-2) + table[b].powi(-2)));
        let own = AppearancePrior { regressor, features: self.features, whole: field.mean.clone(), shares };
        field.mean = own.means();
        let mut held = vec![false; patches.len() * BANDS];
        for (p, features) in self.features.iter().enumerate() {
            let Some(features) = features else { continue };
            field.sd[p] = std::array::from_fn(|b| (sd[b].powi(-2) + table[b].powi(-2)).sqrt().recip());
            let other = own.regressor.without(features, part(&patches[p]));
            for b in 0..BANDS {
                let (error, told) = errors[p][b];
                let number = p * BANDS + b;
                held[number] = told;
                // What sound tells of counts by its standard error, beside a prediction that has not seen it; what it says
                // nothing of begins at the prediction.
                let mean = if told { shares[b] * other[b] + (1.0 - shares[b]) * own.whole[p][b] } else { field.mean[p][b] };
                let trust = if told { error.powi(2) / (error.powi(2) + sd[b].powi(2)) } else { 1.0 };
                x[number] += trust * (mean - x[number]);
            }
        }
        (own, held)
    }

    /// Steps about a field; numbers that are `held` stay.
    fn descend(
        &self,
        field: &mut Field,
        x: &mut [f64],
        mut learnt: Option<&mut AppearancePrior<'_>>,
        held: &[bool],
        each: &mut dyn FnMut(f64),
    ) {
        let hold = |by: &mut [f64]| by.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(by, _)| *by = 0.0);
        let places = self.model.u.places;
        let numbers = self.voxels.patches.len() * BANDS;
        let slopes = self.tie.slopes(&self.whole, &self.means(x), &self.chain_db);
        let mut adam = Adam::new(numbers);
        for step in 0..STEPS {
            let batch = Random::new(self.seed, 0x766F_7800 + step as u64).batch(BATCH, places);
            let (value, mut by) = self.model.mean_response(&self.at(x), batch);
            let weight = self.left(value) / self.independent();
            let means = self.means(x);
            let mut by_means = vec![0.0; means.len()];
            self.tie.add(&slopes, &self.whole, &means, weight, &mut by_means);
            self.by_patches(x, &means, &by_means, &mut by);
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

    pub(super) fn at<'b>(&'b self, x: &'b [f64]) -> Iterate<'b> {
        Iterate { x, geometry: &self.geometry, stage: &self.stage, diffuse: &self.diffuse }
    }

    /// The mean loss of all responses.
    pub(super) fn mean_loss(&self, at: &Iterate<'_>) -> f64 {
        let places = self.model.u.places;
        (0..places).into_par_iter().map(|i| self.model.response(at, i).0).sum::<f64>() / places as f64
    }

    /// What a mean difference weighs against what is known: see the full fit.
    pub(super) fn left(&self, value: f64) -> f64 {
        if self.stage.what == Compared::Waves { 1.0 } else { value.max(0.02) }
    }

    fn independent(&self) -> f64 {
        0.5 * 2.0 * HIGHEST * (self.model.length * self.model.u.places) as f64
    }

    /// Numbers of the whole with means of the patches.
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

    /// Derivatives by patches from those by means.
    fn by_patches(&self, x: &[f64], means: &[f64], by_means: &[f64], by: &mut [f64]) {
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

    fn result(&self, x: &[f64], field: &Field, regressor: Option<&Regressor>) -> VoxelFit {
        let (features, count) = (self.features, self.features.len());
        let (told, known) = (self.errors(x, field, &vec![self.table; count]), self.errors(x, field, &field.sd));
        let estimate = |p: usize, b: usize| Estimate::of_logit(x[p * BANDS + b], known[p][b].0, told[p][b].1);
        let stage = self.model.stage(Compared::Magnitudes, (LOWEST_HZ, HIGHEST * self.model.rate_hz));
        let left = self.mean_loss(&Iterate { stage: &stage, ..self.at(x) });
        let mean = |b: usize| (0..count).map(|p| estimate(p, b).value).sum::<f64>() / count as f64;
        let off = |r: &Regressor| std::array::from_fn(|b| r.off[b].min(self.table[b]) * mean(b) * (1.0 - mean(b)));
        let mut found = VoxelFit {
            voxels: Arc::clone(&self.voxels),
            absorption: (0..count).map(|p| std::array::from_fn(|b| estimate(p, b))).collect(),
            guessed: Vec::new(),
            off: regressor.map(off),
            shown: features.iter().flatten().count(),
            left,
        };
        let guessed = |p: usize| regressor.is_some() && features[p].is_some() && !found.is_touched(p);
        found.guessed = (0..count).map(guessed).collect();
        found
    }
}
