//! All numbers that a full fit seeks, in one row, and what was known of them before.

use crate::bands::{BANDS, Bands};
use crate::measurements::Measurements;
use promenade_acoustics::{Materials, OCTAVES_HZ};

/// Logit of a scattering of 0.2, its standard deviation, and that of the step from one band to the next.
const SCATTERING: (f64, f64, f64) = (-1.4, 1.0, 0.3);
/// Standard deviation of the directivity towards a node, nepers, and of the step from one band to the next.
const DIRECTIVITY: (f64, f64) = (0.35, 0.15);
/// Standard deviation of the level over that of the chain's window, nepers, what it grows by for each octave below this
/// frequency, and that, hertz: lower octaves have walls in the window.
const LEVEL: (f64, f64) = (0.03, 0.12);
const LEVEL_HZ: f64 = 800.0;
/// Standard deviation of walls after the scan, metres.
pub(crate) const WALL_SD_M: f64 = 0.02;

/// Where in the row which number stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unknowns {
    pub(crate) surfaces: usize,
    pub(crate) nodes: usize,
    pub(crate) walls: usize,
    pub(crate) places: usize,
}

impl Unknowns {
    /// Numbers of a place: coordinates of source and microphone, metres, and the clock's offset, milliseconds.
    pub(crate) const PLACE: usize = 7;

    pub(crate) fn absorption(&self, surface: usize, band: usize) -> usize {
        surface * BANDS + band
    }

    pub(crate) fn scattering(&self, band: usize) -> usize {
        self.surfaces * BANDS + band
    }

    pub(crate) fn level(&self, band: usize) -> usize {
        (self.surfaces + 1) * BANDS + band
    }

    pub(crate) fn node(&self, node: usize, band: usize) -> usize {
        (self.surfaces + 2 + node) * BANDS + band
    }

    pub(crate) fn wall(&self, wall: usize) -> usize {
        (self.surfaces + 2 + self.nodes) * BANDS + wall
    }

    pub(crate) fn place(&self, place: usize) -> usize {
        self.wall(self.walls) + Self::PLACE * place
    }

    pub(crate) fn count(&self) -> usize {
        self.place(self.places)
    }
}

/// A belief about the numbers: a mean and a standard deviation for each, 0 of which says nothing, and steps between numbers.
pub(crate) struct Prior {
    pub(crate) mean: Vec<f64>,
    pub(crate) sd: Vec<f64>,
    /// Two numbers, the mean of the second less the first, and its standard deviation.
    steps: Vec<(usize, usize, f64, f64)>,
}

/// Mean and standard deviation of the logit of absorption over the table of materials, by octave from 125 Hz, and the standard
/// deviation of its step over an octave.
pub(crate) fn of_table() -> ([f64; 7], [f64; 7], f64) {
    let logit = |a: f32| (f64::from(a).clamp(0.01, 0.99) / (1.0 - f64::from(a).clamp(0.01, 0.99))).ln();
    let rows: Vec<[f64; 7]> = Materials::default().absorbing().map(|(_, e)| e.shares.map(logit)).collect();
    let count = rows.len() as f64;
    let mean: [f64; 7] = std::array::from_fn(|o| rows.iter().map(|r| r[o]).sum::<f64>() / count);
    let sd = std::array::from_fn(|o| (rows.iter().map(|r| (r[o] - mean[o]).powi(2)).sum::<f64>() / count).sqrt());
    let step = |r: &[f64; 7]| {
        (1..7).map(|o| (r[o] - r[o - 1] - mean[o] + mean[o - 1]).powi(2)).sum::<f64>() / (OCTAVES_HZ.len() - 1) as f64
    };
    (mean, sd, (rows.iter().map(step).sum::<f64>() / count).sqrt())
}

impl Prior {
    /// The table's for surfaces, stated uncertainties for places. `sharpness` is that of a facing source's directivity, at
    /// nodes whose cosines to the axis are given.
    pub(crate) fn new(
        u: &Unknowns,
        set: &Measurements,
        bands: &Bands,
        sharpness: &[f64; BANDS],
        cosines: &[f64],
        axis: bool,
    ) -> Self {
        let mut prior = Self { mean: vec![0.0; u.count()], sd: vec![0.0; u.count()], steps: Vec::new() };
        let (mean, sd, octave) = of_table();
        let (mean, sd) = (bands.of_material_octaves(&mean), bands.of_material_octaves(&sd));
        let octaves = bands.octaves_apart();
        let mut set_one = |i: usize, mean: f64, sd: f64| (prior.mean[i], prior.sd[i]) = (mean, sd);
        for b in 0..BANDS {
            (0..u.surfaces).for_each(|s| set_one(u.absorption(s, b), mean[b], sd[b]));
            set_one(u.scattering(b), SCATTERING.0, SCATTERING.1);
            let below = (LEVEL_HZ / bands.centres_hz[b]).max(1.0).log2();
            set_one(u.level(b), 0.0, LEVEL.0 + LEVEL.1 * below);
            for (node, cosine) in cosines.iter().enumerate().take(u.nodes) {
                // What is sent on the axis is the chain's, where sources have an axis.
                let beside = if axis { (2.0 * (1.0 - cosine)).min(1.0) } else { 1.0 };
                set_one(u.node(node, b), sharpness[b] * (cosine - 1.0), DIRECTIVITY.0 * beside.max(0.1));
            }
        }
        (0..u.walls).for_each(|w| set_one(u.wall(w), 0.0, WALL_SD_M));
        for (i, m) in set.all.iter().enumerate() {
            let at = u.place(i);
            (0..3).for_each(|a| set_one(at + a, 0.0, m.source.sd_m));
            (3..6).for_each(|a| set_one(at + a, 0.0, m.microphone.sd_m));
        }
        for b in 1..BANDS {
            for s in 0..u.surfaces {
                let (i, j) = (u.absorption(s, b - 1), u.absorption(s, b));
                prior.steps.push((i, j, mean[b] - mean[b - 1], octave * octaves.sqrt()));
            }
            prior.steps.push((u.scattering(b - 1), u.scattering(b), 0.0, SCATTERING.2));
            for n in 0..u.nodes {
                let (i, j) = (u.node(n, b - 1), u.node(n, b));
                let step = prior.mean[j] - prior.mean[i];
                prior.steps.push((i, j, step, DIRECTIVITY.1));
            }
        }
        prior
    }

    /// Half the sum of squares, in standard deviations, and adds its derivatives, all times a weight.
    pub(crate) fn add(&self, x: &[f64], weight: f64, by: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for (i, v) in x.iter().enumerate().filter(|(i, _)| self.sd[*i] > 0.0) {
            let off = (v - self.mean[i]) / self.sd[i];
            sum += 0.5 * off * off;
            by[i] += weight * off / self.sd[i];
        }
        for (i, j, step, sd) in &self.steps {
            let off = (x[*j] - x[*i] - step) / sd;
            sum += 0.5 * off * off;
            by[*j] += weight * off / sd;
            by[*i] -= weight * off / sd;
        }
        weight * sum
    }

    /// Adds its precision to that of some of the numbers, of which `number` says where they stand.
    pub(crate) fn add_precision(&self, numbers: &[usize], to: &mut nalgebra::DMatrix<f64>) {
        for (k, i) in numbers.iter().enumerate().filter(|(_, i)| self.sd[**i] > 0.0) {
            to[(k, k)] += self.sd[*i].powi(-2);
        }
        let place = |i: &usize| numbers.binary_search(i).ok();
        for (i, j, _, sd) in &self.steps {
            if let (Some(a), Some(b)) = (place(i), place(j)) {
                let p = sd.powi(-2);
                to[(a, a)] += p;
                to[(b, b)] += p;
                to[(a, b)] -= p;
                to[(b, a)] -= p;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_materials_absorb_more_at_higher_octaves() {
        let (mean, sd, step) = of_table();
        assert!(
            mean[0] < mean[4] && sd.iter().all(|s| (0.3..3.0).contains(s)) && (0.1..2.0).contains(&step),
            "{mean:?} {sd:?} {step}"
        );
    }
}
