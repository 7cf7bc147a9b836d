//! Responses of a fitted room at any place.

mod unexplained;

use crate::band_signal::{BandSignal, Impulses};
use crate::bands::{BANDS, Bands, PerBand};
use crate::chain::Chain;
use crate::energy_model::{BIN_S, ORDER, Octave};
use crate::figures::{Convention, Figures};
use crate::flat_room::Way;
use crate::full_fit::{FullFit, late_energies};
use crate::measurements::{Measurement, Measurements};
use crate::octaves::octaves_at;
use crate::quick::QuickFit;
use crate::random::Random;
use crate::residual::Residual;
use crate::tail::Noise;
use crate::walls::{Path, Walls};
use promenade_fourier::{signal, spectrum};
use rayon::prelude::*;

/// Images farther than this behind the direct sound are left to the tail, seconds.
const IMAGES_S: f64 = 0.17;
/// Samples before the direct sound in which bands of low frequencies ring, and those of them that are kept.
const RINGS: (usize, usize) = (512, 32);
/// How far walls are from where they are said to be, and from being flat, as a standard deviation, metres.
const WALLS_SD_M: f64 = 0.02;
/// Draws of noise that figures are the mean of.
pub const DRAWS: u64 = 8;

/// What a box does to images, by band.
#[derive(Clone, Debug, PartialEq)]
pub struct Early {
    /// Amplitude that each wall's mirror leaves.
    pub walls: [PerBand; 6],
    /// Sharpness of the source.
    pub sharpness: PerBand,
    /// Decay of the energy in air, per metre.
    pub air_per_m: PerBand,
}

/// What makes the images.
enum Images {
    Quick {
        early: Box<Early>,
        walls: Walls,
        facing: bool,
    },
    Full(Box<FullFit>),
    /// The direct sound alone.
    None,
}

/// A way of sound with its amplitudes.
struct Arrival {
    length_m: f64,
    order: u32,
    gains: PerBand,
}

/// A fitted room as an instrument.
pub struct Foretold {
    images: Images,
    /// Amplitudes of the direct sound and of all reflections over what chain and surfaces make of them.
    amplitudes: [PerBand; 2],
    residual: Residual,
    signal: BandSignal,
    chain: Chain,
    /// Energies by bin since the source sounded, by octave, with the source's level.
    diffuse: Vec<Vec<f64>>,
    noise: Vec<Noise>,
    rate_hz: f64,
    length: usize,
}

impl Early {
    /// Of the octaves of a fit.
    #[must_use]
    pub fn of(octaves: &[Octave], bands: &Bands) -> Self {
        let all = |of: &dyn Fn(&Octave) -> f64| bands.from_octaves(&octaves.iter().map(of).collect::<Vec<f64>>());
        let wall = |w: usize| {
            let left = |o: &Octave| ((1.0 - o.surfaces[w].absorption) * (1.0 - o.surfaces[w].scattering)).max(1e-9).ln();
            all(&left).map(|l| (0.5 * l).exp())
        };
        Self { walls: std::array::from_fn(wall), sharpness: all(&|o| o.sharpness), air_per_m: all(&|o| o.air_per_m) }
    }

    /// Amplitudes of a path where the direct sound at 1 m on the axis has 1.
    #[must_use]
    pub fn gains(&self, path: &Path, facing: Option<[f64; 3]>) -> PerBand {
        let off_axis = facing.map_or(0.0, |f| f.iter().zip(path.departure).map(|(a, b)| a * b).sum::<f64>() - 1.0);
        std::array::from_fn(|b| {
            let walls: f64 = self.walls.iter().zip(path.hits).map(|(w, n)| w[b].powi(i32::from(n))).product();
            let rest = self.sharpness[b] * off_axis - 0.5 * self.air_per_m[b] * path.length_m;
            walls * rest.exp() / path.length_m
        })
    }
}

impl Foretold {
    /// Of a quick fit and the measurements that it was made of; `None` of no measurements. Responses are as long as the
    /// longest of them.
    #[must_use]
    pub fn new(fit: &QuickFit, set: &Measurements) -> Option<Self> {
        let rate_hz = f64::from(set.sample_rate_hz);
        let levels: Vec<f64> = fit.octaves.iter().map(|o| o.level_db).collect();
        let chain = Chain::of(set)?.with_levels(&levels, rate_hz);
        let length = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0);
        let octaves: Vec<Octave> = fit.octaves.iter().enumerate().map(|(o, f)| f.octave(o, &fit.histories.air)).collect();
        let diffuse = octaves
            .iter()
            .zip(&levels)
            .map(|(octave, level)| {
                let mut energies = octave.diffuse(&fit.histories, fit.facing);
                energies.iter_mut().for_each(|e| *e *= 10f64.powf(level / 10.0));
                energies
            })
            .collect();
        let images =
            Images::Quick { early: Box::new(Early::of(&octaves, &Bands::new(rate_hz))), walls: fit.walls, facing: fit.facing };
        Some(Self::made(images, chain, diffuse, rate_hz, length, fit.residual.clone()))
    }

    /// Of a full fit and the measurements that it was made of.
    #[must_use]
    pub fn of_full(fit: &FullFit, set: &Measurements) -> Self {
        let rate_hz = f64::from(set.sample_rate_hz);
        let length = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0);
        let diffuse = late_energies(fit, rate_hz);
        let images = Images::Full(Box::new(fit.clone()));
        Self::made(images, fit.chain.clone(), diffuse, rate_hz, length, fit.residual.clone())
    }

    /// Without a room: the direct sound, and a tail with the energies that are measured in the median over places. `None` of no
    /// measurements.
    #[must_use]
    pub fn without_room(set: &Measurements) -> Option<Self> {
        let rate_hz = f64::from(set.sample_rate_hz);
        let chain = Chain::of(set)?;
        let length = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0);
        // Energies are the residual's over this one, which is so small that no floor of it is met.
        let far = set.all.iter().map(Measurement::distance_m).fold(0.0, f64::max);
        let bins = ((length as f64 / rate_hz + far / chain.speed_m_s) / BIN_S) as usize + 4;
        let diffuse = vec![vec![1e-6; bins]; octaves_at(rate_hz)];
        let bare = Self::made(Images::None, chain.clone(), diffuse.clone(), rate_hz, length, Residual::default());
        let residual = bare.unexplained(set);
        Some(Self::made(Images::None, chain, diffuse, rate_hz, length, residual))
    }

    fn made(images: Images, chain: Chain, diffuse: Vec<Vec<f64>>, rate_hz: f64, length: usize, residual: Residual) -> Self {
        let noise = (0..DRAWS).into_par_iter().map(|seed| Noise::new(&chain.response, length, rate_hz, seed)).collect();
        let samples = ((IMAGES_S * rate_hz) as usize + 2 * chain.response.len() + 2 * RINGS.0).next_power_of_two();
        let bands = Bands::new(rate_hz);
        let signal = BandSignal::new(samples, rate_hz, &bands);
        let amplitudes = residual.amplitudes(&bands);
        Self { images, amplitudes, residual, signal, chain, diffuse, noise, rate_hz, length }
    }

    /// The ways to a measurement's places, the direct one first where it is free.
    fn arrivals(&self, at: &Measurement) -> Vec<Arrival> {
        let reach = at.distance_m() + IMAGES_S * self.chain.speed_m_s;
        match &self.images {
            Images::Quick { early, walls, facing } => {
                let faces = at.source.facing.filter(|_| *facing);
                let paths = walls.paths(at.source.at_m, at.microphone.at_m, ORDER, reach);
                let of = |p: &Path| Arrival { length_m: p.length_m, order: p.order(), gains: early.gains(p, faces) };
                paths.iter().map(of).collect()
            }
            Images::None => {
                let length_m = at.distance_m();
                vec![Arrival { length_m, order: 0, gains: [1.0 / length_m; BANDS] }]
            }
            Images::Full(fit) => {
                let [source, microphone] = fit.found(at);
                let sequences = fit.room.sequences(&[(source, microphone)], fit.order).unwrap_or_default();
                let Some(own) = sequences.first() else { return Vec::new() };
                let ways = fit.room.ways(own, source, microphone, fit.order, reach);
                let of = |w: &Way| Arrival { length_m: w.length_m, order: w.order(), gains: fit.gains(w, at.source.facing) };
                ways.iter().map(of).collect()
            }
        }
    }

    /// The response at a measurement's places, by one draw of noise.
    #[must_use]
    pub fn response(&self, at: &Measurement, draw: usize) -> Vec<f32> {
        let mut response = self.images(at, draw, &self.amplitudes);
        let start = self.arrival(at);
        for octave in 0..self.diffuse.len() {
            let mut energies = self.rays(at, octave);
            energies.iter_mut().enumerate().for_each(|(bin, e)| *e *= self.residual.at(octave, bin));
            self.noise[draw].add(octave, &mut response, start, &energies, BIN_S * self.rate_hz);
        }
        response
    }

    /// The sample at which the direct sound of a measurement is foretold.
    fn arrival(&self, at: &Measurement) -> usize {
        (self.chain.arrival_s(at.distance_m()) * self.rate_hz).floor() as usize
    }

    /// Energies of diffuse sound in an octave by bin since the direct sound, without the residual.
    fn rays(&self, at: &Measurement, octave: usize) -> Vec<f64> {
        let energies = &self.diffuse[octave];
        let shift = at.distance_m() / self.chain.speed_m_s / BIN_S;
        let from = |i: usize| energies.get(i).copied().unwrap_or(0.0);
        let (whole, fraction) = (shift as usize, shift.fract());
        (0..energies.len()).map(|i| from(i + whole) * (1.0 - fraction) + from(i + whole + 1) * fraction).collect()
    }

    /// The direct sound and all images, each times its amplitudes by band.
    fn images(&self, at: &Measurement, draw: usize, amplitudes: &[PerBand; 2]) -> Vec<f32> {
        let arrival = self.chain.arrival_s(at.distance_m());
        let arrivals = self.arrivals(at);
        // The early signal begins with whole samples before the arrival, so that the fraction is in the impulses' times.
        let start = (arrival * self.rate_hz).floor();
        let lead = self.chain.lead as f64 / self.rate_hz;
        let direct_m = arrivals.iter().map(|a| a.length_m).fold(f64::INFINITY, f64::min).min(1e3);
        let offset = arrival - start / self.rate_hz + RINGS.0 as f64 / self.rate_hz;
        // Where places and walls are not known to a wave's length, images that a symmetric box would add up in step are not in
        // step.
        let mut random = Random::new(draw as u64, 0x696D_6167);
        let known_m = at.source.sd_m.hypot(at.microphone.sd_m);
        let mut time_s = |p: &Arrival| {
            let off = if p.order == 0 { 0.0 } else { known_m.hypot(WALLS_SD_M * f64::from(p.order).sqrt()) * random.normal() };
            (offset + (p.length_m - direct_m + off) / self.chain.speed_m_s).max(offset)
        };
        let gains = |a: &Arrival| -> PerBand { std::array::from_fn(|b| a.gains[b] * amplitudes[usize::from(a.order > 0)][b]) };
        let of = Impulses {
            times_s: arrivals.iter().map(&mut time_s).collect(),
            gains: arrivals.iter().map(gains).collect::<Vec<[f64; BANDS]>>(),
        };
        let mut bins = self.signal.spectrum(&of);
        let chain = spectrum(self.chain.response.iter().copied(), self.signal.length());
        bins.iter_mut().zip(&chain).for_each(|(b, c)| *b *= c);
        let early = signal(bins, self.signal.length());
        let mut response = vec![0.0_f32; self.length];
        let first = start as isize - RINGS.0 as isize - (lead * self.rate_hz).round() as isize;
        for (i, v) in early.iter().enumerate().skip(RINGS.0 - RINGS.1) {
            if let Some(slot) =
                first.checked_add_unsigned(i).and_then(|k| usize::try_from(k).ok()).and_then(|k| response.get_mut(k))
            {
                *slot += *v as f32;
            }
        }
        response
    }

    /// Figures at a measurement's places, the mean over all draws of noise.
    #[must_use]
    pub fn figures(&self, at: &Measurement, convention: Convention) -> Option<Figures> {
        let all: Vec<Figures> =
            (0..self.noise.len()).map(|draw| Figures::of(&self.response(at, draw), self.rate_hz, convention)).collect();
        Figures::mean(&all)
    }
}
