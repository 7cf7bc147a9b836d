//! Levels of responses by hop and band, and responses with other levels.

use super::{Example, Pair, scaled};
use crate::gains::Gains;
use crate::responses::{Cutter, certainty, grid};
use promenade_core::{Bands, StftGrid};
use promenade_metrics::onset;

/// Hops after the direct sound, of about 5.8 ms.
const HOPS: usize = 64;
/// Levels are told as so many decibels over this one.
const MIDDLE_DB: f32 = -30.0;
const SCALE_DB: f32 = 20.0;
/// Levels so far below a response's loudest are silence, dB.
const SILENCE_DB: f32 = -80.0;
/// A level tells something where it is so far above the response's noise, dB.
const OVER_NOISE_DB: f32 = 8.0;
/// Share of a response, at its end, whose quietest hop is its noise.
const END: f32 = 0.25;
/// Gains are smoothed over one hop more on either side for so many hops, and over so many at most.
const HOPS_PER_SMOOTHED: usize = 3;
const MOST_SMOOTHED: usize = 6;
/// Gains that are believed, dB.
const MOST_DB: f32 = 40.0;

/// The cells of levels.
pub(super) struct LevelGrid {
    grid: StftGrid,
    bands: Bands,
    cutter: Cutter,
    channels: usize,
}

/// Decibels of levels in the network's terms.
pub(super) fn in_db(levels: &[f32]) -> Vec<f32> {
    levels.iter().map(|level| MIDDLE_DB + SCALE_DB * level).collect()
}

impl LevelGrid {
    pub(super) fn new(sample_rate_hz: f64, channels: usize) -> Self {
        let (grid, bands) = (grid(sample_rate_hz), Bands::for_rate(sample_rate_hz));
        let cutter = Cutter::new(&grid, &bands);
        Self { grid, bands, cutter, channels }
    }

    pub(super) fn rate_hz(&self) -> f64 {
        self.grid.sample_rate_hz
    }

    /// Levels of a hop.
    pub(super) fn features(&self) -> usize {
        self.channels * self.bands.count()
    }

    /// The sample of the direct sound, of all channels together.
    fn centre(channels: &[Vec<f32>]) -> usize {
        channels.iter().filter_map(|x| onset(x)).min().unwrap_or(0)
    }

    /// Powers, `[hop][channel][band]`, the direct sound being the first hop.
    fn powers(&self, channels: &[Vec<f32>]) -> Vec<f32> {
        let centre = Self::centre(channels);
        let of = |ear: &Vec<f32>| {
            let direct = self.cutter.by_band(&self.cutter.direct(ear, centre));
            let mut all = vec![direct];
            all.extend(self.cutter.hops(ear, centre).into_iter().take(HOPS));
            all.resize(1 + HOPS, vec![0.0; self.bands.count()]);
            all
        };
        let all: Vec<Vec<Vec<f32>>> = channels.iter().map(of).collect();
        (0..=HOPS).flat_map(|l| all.iter().flat_map(move |ear| ear[l].iter().copied())).collect()
    }

    /// Levels in dB, none below silence.
    fn db(powers: &[f32]) -> Vec<f32> {
        let db = |power: f32| 10.0 * power.max(f32::MIN_POSITIVE).log10();
        let loudest = powers.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        powers.iter().map(|power| db(*power).max(db(loudest) + SILENCE_DB)).collect()
    }

    /// Levels of a response in the network's terms, with a gain.
    pub(super) fn levels(&self, channels: &[Vec<f32>], gain_db: f32) -> Vec<f32> {
        Self::db(&self.powers(channels)).iter().map(|db| (db + gain_db - MIDDLE_DB) / SCALE_DB).collect()
    }

    /// Levels of a response in dB, and whether each is above the response's noise.
    pub(super) fn told(&self, channels: &[Vec<f32>]) -> (Vec<f32>, Vec<bool>) {
        let levels = Self::db(&self.powers(channels));
        let row = self.features();
        let first = ((1.0 - END) * HOPS as f32) as usize;
        let noise: Vec<f32> =
            (0..row).map(|i| (first..=HOPS).map(|l| levels[l * row + i]).fold(f32::INFINITY, f32::min)).collect();
        let loudest = levels.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let told = |(i, level): (usize, &f32)| {
            *level > noise[i % row] + OVER_NOISE_DB && *level > loudest + SILENCE_DB + OVER_NOISE_DB
        };
        let counts = levels.iter().enumerate().map(told).collect();
        (levels, counts)
    }

    /// The gain that simulated responses need to be as loud as measured ones in the median, dB.
    pub(super) fn level_db(&self, pairs: &[Pair]) -> f32 {
        let energy = |channels: &[Vec<f32>]| channels.iter().flatten().map(|x| f64::from(*x).powi(2)).sum::<f64>();
        let of =
            |pair: &Pair| 10.0 * (energy(&pair.measured) / energy(&pair.simulated.channels).max(f64::MIN_POSITIVE)).log10();
        let mut all: Vec<f64> = pairs.iter().map(of).filter(|db| db.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0) as f32
    }

    pub(super) fn example(&self, pair: &Pair, level_db: f32, places: &[(f32, f32)]) -> Example {
        let (measured, told) = self.told(&pair.measured);
        let sure = |(i, db): (usize, &f32)| match pair.noise.get(i % self.features()) {
            Some(noise) => certainty(10.0_f32.powf(db / 10.0), *noise),
            None => f32::from(u8::from(told[i])),
        };
        Example {
            simulated: self.levels(&pair.simulated.channels, level_db),
            measured: measured.iter().map(|db| (db - MIDDLE_DB) / SCALE_DB).collect(),
            counts: measured.iter().enumerate().map(sure).collect(),
            places: scaled(&pair.simulated.places, places),
        }
    }

    /// A response whose levels were one thing in the network's terms and shall be another. Gains are smoothed over the later
    /// the more hops, so that the response keeps the chance of its own carriers.
    pub(super) fn reshaped(&self, channels: &[Vec<f32>], level_db: f32, [own, new]: [&[f32]; 2]) -> Vec<Vec<f32>> {
        let (row, count, centre) = (self.features(), self.bands.count(), Self::centre(channels));
        let gain = |i: usize| {
            let hop = i / row;
            let around = (hop / HOPS_PER_SMOOTHED).min(MOST_SMOOTHED);
            let hops = hop.saturating_sub(around).max(hop.min(1))..=(hop + around).min(HOPS);
            let count = hops.clone().count() as f32;
            let off = hops.map(|l| new[l * row + i % row] - own[l * row + i % row]).sum::<f32>() / count;
            10.0_f32.powf((level_db + (SCALE_DB * off).clamp(-MOST_DB, MOST_DB)) / 20.0)
        };
        let one = |(channel, ear): (usize, &Vec<f32>)| {
            let band = |hop: usize, band: usize| gain(hop * row + channel * count + band);
            let direct = |k: usize| {
                let weights = self.bands.weights(self.grid.bin_hz(k) as f32);
                weights.into_iter().map(|(b, weight)| weight * band(0, b)).sum()
            };
            let direct = (0..self.grid.bins()).map(direct).collect();
            let hops = (1..=HOPS).map(|hop| (0..count).map(|b| band(hop, b)).collect()).collect();
            Gains { direct, hops }.applied(ear, centre, &self.grid, &self.bands)
        };
        channels.iter().enumerate().map(one).collect()
    }
}
