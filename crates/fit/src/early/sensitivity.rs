//! What responses tell of the numbers: how they grow with each, how precisely paths are known, whether waves agree, and which
//! chain explains them best.

use super::band_signal::Impulses;
use super::iterate::{Geometry, Iterate};
use super::loss::Compared;
use super::model::{CHAIN_S, EarlyModel};
use super::source_nodes::Shares;
use crate::bands::{BANDS, PerBand, logistic};
use crate::room::Path;
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use rayon::prelude::*;

/// Paths of so many reflections at most are asked what a response tells of them.
const TOLD: u32 = 4;
/// Share of the mean power below which frequencies say little of the chain.
const RIDGE: f64 = 1e-4;

impl EarlyModel<'_> {
    /// How the logarithms of a response grow with some numbers through its images; numbers have to be of surfaces, scattering
    /// or level.
    pub(crate) fn tangents(&self, at: &Iterate<'_>, i: usize, numbers: &[usize]) -> Vec<Vec<f64>> {
        let (paths, of) = self.impulses(at.x, at.geometry, i);
        let u = &self.u;
        let grown = |number: &usize| {
            let (row, band) = (number / BANDS, number % BANDS);
            let share = if row <= u.surfaces { -0.5 * logistic(at.x[*number]) } else { 1.0 };
            let times = |path: &Path| match row {
                r if r < u.surfaces => path.hits.iter().find(|(s, _)| usize::from(*s) == r).map_or(0.0, |(_, n)| *n),
                r if r == u.surfaces => f64::from(path.order()),
                _ => 1.0,
            };
            let gains = paths.iter().zip(&of.gains).map(|((path, _), g)| {
                let mut own = [0.0; BANDS];
                own[band] = g[band] * times(path) * share;
                own
            });
            self.through(&Impulses { times_s: of.times_s.clone(), gains: gains.collect() }, at)
        };
        let (stage, found, noise) = (at.stage, self.through(&of, at), self.noise(at, i));
        numbers.par_iter().map(|n| stage.loss.along(stage.what, &found, &grown(n), &noise, &stage.targets[i])).collect()
    }

    /// How the logarithms of a response grow with some numbers of walls, places and clocks, by small steps.
    pub(crate) fn moving_tangents(&self, at: &Iterate<'_>, i: usize, numbers: &[usize]) -> Vec<Vec<f64>> {
        const STEP: f64 = 1e-4;
        let of = |x: &[f64]| self.through(&self.impulses(x, at.geometry, i).1, at);
        let (stage, found, noise) = (at.stage, of(at.x), self.noise(at, i));
        let grown = |number: &usize| {
            let moved = |by: f64| {
                let mut moved = at.x.to_vec();
                moved[*number] += by;
                of(&moved)
            };
            let by: Vec<f64> = moved(STEP).iter().zip(moved(-STEP)).map(|(a, b)| (a - b) / (2.0 * STEP)).collect();
            stage.loss.along(stage.what, &found, &by, &noise, &stage.targets[i])
        };
        numbers.par_iter().map(grown).collect()
    }

    /// What a response tells of the logarithm of the amplitude of each of its paths of few reflections, by band: precisions,
    /// where `left` is the mean difference of logarithms that is left.
    pub(crate) fn path_precisions(&self, at: &Iterate<'_>, i: usize, left: f64) -> Vec<(Path, PerBand)> {
        let (paths, of) = self.impulses(at.x, at.geometry, i);
        let (stage, found, noise) = (at.stage, self.through(&of, at), self.noise(at, i));
        let weight = if stage.what == Compared::Magnitudes { 0.5 / left.powi(2) } else { 1.0 };
        let one = |(k, (path, _)): (usize, (Path, Shares))| {
            let alone = Impulses { times_s: vec![of.times_s[k]], gains: vec![of.gains[k]] };
            let step = self.through(&alone, at);
            let told = stage.loss.told(stage.what, &found, &step, &noise, &stage.targets[i], &self.bands);
            (path, told.map(|t| weight * t))
        };
        paths.into_iter().enumerate().filter(|(_, (path, _))| (1..=TOLD).contains(&path.order())).map(one).collect()
    }

    /// How far the waves of each response are from those of the model, over what is expected: about 1 if times are right.
    pub(crate) fn agreement(&self, at: &Iterate<'_>) -> Vec<f64> {
        let one = |i: usize| {
            let found = self.through(&self.impulses(at.x, at.geometry, i).1, at);
            let (sum, count) = at.stage.loss.agreement(&found, &self.noise(at, i), &at.stage.targets[i]);
            if count > 0.0 { sum / count } else { f64::INFINITY }
        };
        (0..self.u.places).into_par_iter().map(one).collect()
    }

    /// The chain that explains best what was observed, with all numbers as they are: least squares over frequencies, cut to the
    /// chain's length.
    pub(crate) fn renewed_chain(&self, x: &[f64], geometry: &Geometry) -> Vec<Complex64> {
        let padded = self.signal.length();
        let fade = (0.2 * self.length as f64) as usize;
        let weight = |i: usize| (self.length.saturating_sub(i) as f64 / fade as f64).min(1.0);
        let parts: Vec<(Vec<Complex64>, Vec<Complex64>)> = (0..self.observed.len())
            .into_par_iter()
            .map(|i| {
                let (_, of) = self.impulses(x, geometry, i);
                let faded = |x: &[f64]| spectrum(x.iter().enumerate().map(|(i, v)| v * weight(i)), padded);
                (faded(&signal(self.signal.spectrum(&of), padded)), faded(&self.observed[i].samples))
            })
            .collect();
        let mut power = vec![0.0; padded / 2 + 1];
        let mut product = vec![Complex64::default(); padded / 2 + 1];
        for ((m, observed), one) in parts.iter().zip(&self.set.all) {
            // Places count alike, however near the source is.
            let weight = one.distance_m().powi(2);
            for (k, (m, h)) in m.iter().zip(observed).enumerate() {
                power[k] += weight * m.norm_sqr();
                product[k] += m.conj() * h * weight;
            }
        }
        let mean = power.iter().sum::<f64>() / power.len() as f64;
        product.iter_mut().zip(&power).for_each(|(c, p)| *c /= p + RIDGE * mean);
        let mut response = signal(product, padded);
        let (before, after) = ((CHAIN_S.0 * self.rate_hz) as usize, (CHAIN_S.1 * self.rate_hz) as usize);
        for (i, v) in response.iter_mut().enumerate() {
            // What lies before the first sample comes at the end of the circle.
            let weight = if i < padded / 2 { 1.0 - i as f64 / after as f64 } else { 1.0 - (padded - i) as f64 / before as f64 };
            *v *= (2.0 * weight).clamp(0.0, 1.0);
        }
        spectrum(response, padded)
    }
}
