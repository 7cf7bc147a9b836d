//! The late part, tied to the surfaces through rays: what reverberation times and late levels say of absorption.
//!
//! By octave there are two numbers, means over all places: T20, and energy between 80 and 250 ms after the direct sound over
//! that of the chain. The rays' answer is taken along its slopes by each surface about where the numbers are, anew in each
//! round.

use super::histories::{Histories, Surface};
use crate::bands::{BANDS, Bands, FITTED_HZ, PerBand, db, logistic, logit, measures, octave_decays, octaves_at};
use crate::early::{Diffuse, EarlyModel};
use crate::error::FitError;
use crate::measurements::Measurements;
use crate::room::FlatRoom;
use rayon::prelude::*;

/// Standard deviations of what rays say of T20 as a share, and of the late level, dB.
const SD: [f64; 2] = [0.03, 1.0];
/// The late part, seconds after the direct sound.
const LATE_S: (f64, f64) = (0.08, 0.25);
/// Length of a bin of energies, seconds.
pub(crate) const BIN_S: f64 = 0.004;
/// Steps of logits for slopes.
const STEP: f64 = 0.05;
/// Octaves below this are fitted by nothing here: no bands lie there, hertz.
const LEAST_HZ: f64 = 100.0;

/// What was measured of an octave.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Octave {
    t20_s: f64,
    late_db: f64,
}

/// Rays and what they are compared with.
pub(crate) struct LateTie {
    pub(crate) histories: Histories,
    octaves: Vec<Option<Octave>>,
    /// Share of each band in each octave.
    shares: Vec<PerBand>,
    distances_m: Vec<f64>,
    order: u32,
}

/// The answer of rays about some numbers.
pub(crate) struct Slopes {
    octaves: Vec<OctaveSlopes>,
}

struct OctaveSlopes {
    number: usize,
    at: [f64; 2],
    /// Octave's logits of each surface and of scattering, about which it holds.
    about: Vec<f64>,
    by: Vec<[f64; 2]>,
}

impl LateTie {
    pub(crate) fn new(room: &FlatRoom, set: &Measurements, bands: &Bands, order: u32, seed: u64) -> Result<Self, FitError> {
        let rate = f64::from(set.sample_rate_hz);
        let length_s = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0) as f64 / rate;
        let source = set.all.first().map_or([0.0; 3], |m| m.source.at_m);
        let histories = Histories::of_room(room, set.air, source, BIN_S, length_s.clamp(0.3, 3.0), seed)?;
        let observed: Vec<Vec<[f64; 2]>> = set
            .all
            .par_iter()
            .map(|m| {
                let of = |(bins, measured): (Vec<f64>, [f64; 4])| [measured[0].ln(), 10.0 * late(&bins, 0.0).log10()];
                octave_decays(&m.samples, rate, BIN_S).into_iter().map(of).collect()
            })
            .collect();
        let octaves = (0..octaves_at(rate)).map(|o| {
            // Where few decay far enough above their noise, these are the ones that noise makes so.
            let mean = |i: usize| {
                let all: Vec<f64> = observed.iter().map(|h| h[o][i]).filter(|v| v.is_finite()).collect();
                (2 * all.len() > observed.len()).then(|| all.iter().sum::<f64>() / all.len() as f64)
            };
            (FITTED_HZ[o] >= LEAST_HZ)
                .then_some(())
                .and(mean(0))
                .zip(mean(1))
                .map(|(t, l)| Octave { t20_s: t.exp(), late_db: l })
        });
        let unit = |b: usize| std::array::from_fn::<f64, BANDS, _>(|i| f64::from(u8::from(i == b)));
        let rows: Vec<[f64; 8]> = (0..BANDS).map(|b| bands.to_octaves(&unit(b))).collect();
        Ok(Self {
            histories,
            octaves: octaves.collect(),
            shares: (0..8).map(|o| std::array::from_fn(|b| rows[b][o])).collect(),
            distances_m: set.all.iter().map(|m| m.distance_m()).collect(),
            order,
        })
    }

    /// Octaves in which reverberation is known, hertz.
    pub(crate) fn known_hz(&self) -> Vec<f64> {
        self.octaves.iter().zip(FITTED_HZ).filter(|(o, _)| o.is_some()).map(|(_, hz)| hz).collect()
    }

    fn octave_of(&self, octave: usize, bands: &PerBand) -> f64 {
        self.shares[octave].iter().zip(bands).map(|(s, b)| s * b).sum()
    }

    /// Absorption of each surface and scattering in an octave.
    fn logits(&self, model: &EarlyModel<'_>, x: &[f64], octave: usize) -> Vec<f64> {
        let row = |first: usize| -> f64 {
            let values: PerBand = std::array::from_fn(|b| logistic(x[first + b]));
            logit(self.octave_of(octave, &values))
        };
        (0..=model.u.surfaces).map(|s| row(s * BANDS)).collect()
    }

    /// Rays' T20 as a logarithm, and the late level over that of the direct sound at 1 m in the mean over directions, dB.
    fn rays(&self, logits: &[f64], octave: usize) -> [f64; 2] {
        let (scattering, walls) = logits.split_last().map_or((0.0, logits), |(s, w)| (logistic(*s), w));
        let surfaces: Vec<Surface> = walls.iter().map(|a| Surface { absorption: logistic(*a), scattering }).collect();
        let air = self.histories.air.energy_decay_per_m(FITTED_HZ[octave]);
        let [_, whole] = self.histories.energies(&surfaces, self.order, air);
        let speed = self.histories.air.speed_m_s();
        let mean =
            self.distances_m.iter().map(|d| db(late(&whole, d / speed))).sum::<f64>() / self.distances_m.len().max(1) as f64;
        [measures(&whole, BIN_S)[0].ln(), mean]
    }

    /// Level of the chain and of the source's mean directivity, by octave, dB.
    fn levels_db(&self, model: &EarlyModel<'_>, x: &[f64], chain_db: &[f64], octave: usize) -> f64 {
        let directivity = mean_directivity(model, x);
        let level: PerBand =
            std::array::from_fn(|b| 10.0 * (directivity[b].ln() + 2.0 * x[model.u.level(b)]) / std::f64::consts::LN_10);
        chain_db[octave] + self.octave_of(octave, &level)
    }

    /// Slopes about some numbers. `chain_db` is the chain's energy by octave.
    pub(crate) fn slopes(&self, model: &EarlyModel<'_>, x: &[f64], chain_db: &[f64]) -> Slopes {
        let octaves = (0..self.octaves.len())
            .into_par_iter()
            .filter_map(|o| {
                let measured = self.octaves[o]?;
                let about = self.logits(model, x, o);
                let level = self.levels_db(model, x, chain_db, o);
                let off = |l: &[f64]| {
                    let [t, late] = self.rays(l, o);
                    [(t - measured.t20_s.ln()) / SD[0], (late + level - measured.late_db) / SD[1]]
                };
                let at = off(&about);
                let by: Vec<[f64; 2]> = (0..about.len())
                    .map(|i| {
                        let mut moved = about.clone();
                        moved[i] += STEP;
                        let there = off(&moved);
                        std::array::from_fn(|k| (there[k] - at[k]) / STEP)
                    })
                    .collect();
                let finite = at.iter().chain(by.iter().flatten()).all(|v| v.is_finite());
                finite.then_some(OctaveSlopes { number: o, at, about, by })
            })
            .collect();
        Slopes { octaves }
    }

    /// Half the sum of squares, in standard deviations, and adds its derivatives by all numbers, all times a weight.
    pub(crate) fn add(&self, slopes: &Slopes, model: &EarlyModel<'_>, x: &[f64], weight: f64, by: &mut [f64]) -> f64 {
        let mut sum = 0.0;
        for own in &slopes.octaves {
            let now = self.logits(model, x, own.number);
            for k in 0..2 {
                let gone: f64 = now.iter().zip(&own.about).zip(&own.by).map(|((n, a), by)| by[k] * (n - a)).sum();
                let off = own.at[k] + gone;
                // Beyond some standard deviations it pulls as one that is so far off.
                let pull = off.clamp(-5.0, 5.0);
                sum += pull * (off - 0.5 * pull);
                for (row, slope) in own.by.iter().enumerate() {
                    let row_bands = row * BANDS..(row + 1) * BANDS;
                    let grown = self.by_bands(own.number, &x[row_bands.clone()], now[row], weight * pull * slope[k]);
                    by[row_bands].iter_mut().zip(grown).for_each(|(by, grown)| *by += grown);
                }
            }
        }
        weight * sum
    }

    /// Derivatives by the bands of one row from that by an octave's logit, which is `at`.
    fn by_bands(&self, octave: usize, row: &[f64], at: f64, by_logit: f64) -> PerBand {
        let p = logistic(at);
        std::array::from_fn(|b| {
            let own = logistic(row[b]);
            by_logit * self.shares[octave][b] * own * (1.0 - own) / (p * (1.0 - p)).max(1e-4)
        })
    }

    /// Adds the precision of what rays say to that of all numbers before the levels.
    pub(crate) fn add_precision(&self, slopes: &Slopes, x: &[f64], to: &mut nalgebra::DMatrix<f64>) {
        for own in &slopes.octaves {
            for k in 0..2 {
                let rows = own.by.iter().zip(&own.about).zip(x.chunks_exact(BANDS));
                let row = rows.flat_map(|((slope, about), x)| self.by_bands(own.number, x, *about, slope[k]));
                let some: Vec<(usize, f64)> = row.enumerate().filter(|(_, v)| *v != 0.0).collect();
                for (i, a) in &some {
                    some.iter().for_each(|(j, b)| to[(*i, *j)] += a * b);
                }
            }
        }
    }

    /// Rays of the first part alone, for [`Self::diffuse`].
    pub(crate) fn early(&self, length_s: f64) -> Histories {
        self.histories.first(((length_s / BIN_S) as usize + 2).min(self.histories.bins))
    }

    /// Diffuse energies of those rays, and their slopes if these are asked for.
    pub(crate) fn diffuse(&self, model: &EarlyModel<'_>, x: &[f64], early: &Histories, slopes: bool) -> Diffuse {
        let directivity = mean_directivity(model, x);
        let rows = model.u.surfaces + 1;
        let of_band = |b: usize| -> (Vec<f64>, Vec<Vec<f64>>) {
            let logits: Vec<f64> = (0..rows).map(|r| x[r * BANDS + b]).collect();
            let energies = |logits: &[f64]| {
                let scattering = logistic(logits[rows - 1]);
                let surface = |l: &f64| Surface { absorption: logistic(*l), scattering };
                let surfaces: Vec<Surface> = logits[..rows - 1].iter().map(surface).collect();
                let [diffuse, _] = early.energies(&surfaces, self.order, model.air_per_m[b]);
                diffuse
            };
            let at = energies(&logits);
            let moved = |row: usize| -> Vec<f64> {
                let mut moved = logits.clone();
                moved[row] += STEP;
                energies(&moved).iter().zip(&at).map(|(m, a)| if *a > 0.0 { (m / a).ln() / STEP } else { 0.0 }).collect()
            };
            let by = if slopes { (0..rows).map(moved).collect() } else { Vec::new() };
            (at, by)
        };
        let all: Vec<(Vec<f64>, Vec<Vec<f64>>)> = (0..BANDS).into_par_iter().map(of_band).collect();
        let bins = early.bins;
        Diffuse {
            energies: (0..bins).map(|i| std::array::from_fn(|b| directivity[b] * all[b].0[i])).collect(),
            slopes: (0..bins * usize::from(slopes))
                .map(|i| (0..rows).map(|r| std::array::from_fn(|b| all[b].1[r][i])).collect())
                .collect(),
            bin_s: BIN_S,
        }
    }
}

/// Mean directivity of the source over all directions, as energy by band over that on its axis.
fn mean_directivity(model: &EarlyModel<'_>, x: &[f64]) -> PerBand {
    let nodes = model.u.nodes;
    if nodes == 0 {
        return [1.0; BANDS];
    }
    std::array::from_fn(|b| (0..nodes).map(|n| (2.0 * x[model.u.node(n, b)]).exp()).sum::<f64>() / nodes as f64)
}

/// Energy of the late part where the direct sound comes after a time, of energies by bin.
fn late(bins: &[f64], direct_s: f64) -> f64 {
    let at = |s: f64| ((s / BIN_S).round() as usize).min(bins.len());
    bins[at(direct_s + LATE_S.0)..at(direct_s + LATE_S.1)].iter().sum()
}
