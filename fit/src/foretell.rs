//! Responses of a fitted box at any place.

use crate::band_signal::{BandSignal, Impulses};
use crate::bands::{BANDS, Bands, PerBand};
use crate::chain::Chain;
use crate::energy_model::{BIN_S, ORDER, Octave};
use crate::figures::{Convention, Figures};
use crate::measurements::{Measurement, Measurements};
use crate::octaves::measures;
use crate::quick::QuickFit;
use crate::random::Random;
use crate::tail::Noise;
use crate::walls::Path;
use promenade_acoustics::SPEED_OF_SOUND_M_S;
use promenade_fourier::{signal, spectrum};
use rayon::prelude::*;

/// Images farther than this behind the direct sound are left to the tail, seconds.
const IMAGES_S: f64 = 0.2;
/// Seconds about which the residual turns the decay.
const PIVOT_S: f64 = 0.13;
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
    /// Amplitude of all reflections over what walls make of them.
    pub reflections: PerBand,
}

/// A fitted box as an instrument.
pub struct Foretold {
    early: Early,
    signal: BandSignal,
    chain: Chain,
    walls: crate::walls::Walls,
    /// Energies by bin since the source sounded, by octave, with the source's level and the residual.
    diffuse: Vec<Vec<f64>>,
    noise: Vec<Noise>,
    facing: bool,
    rate_hz: f64,
    length: usize,
}

impl Early {
    /// Of the octaves of a fit, and by how much reflections are stronger than these say.
    #[must_use]
    pub fn of(octaves: &[Octave], residual_db: &[f64], bands: &Bands) -> Self {
        let all = |of: &dyn Fn(&Octave) -> f64| bands.from_octaves(&octaves.iter().map(of).collect::<Vec<f64>>());
        let wall = |w: usize| {
            let left = |o: &Octave| ((1.0 - o.surfaces[w].absorption) * (1.0 - o.surfaces[w].scattering)).max(1e-9).ln();
            all(&left).map(|l| (0.5 * l).exp())
        };
        Self {
            walls: std::array::from_fn(wall),
            sharpness: all(&|o| o.sharpness),
            air_per_m: all(&|o| o.air_per_m),
            reflections: bands.from_octaves(residual_db).map(|db| 10f64.powf(db / 20.0)),
        }
    }

    /// Amplitudes of a path where the direct sound at 1 m on the axis has 1.
    #[must_use]
    pub fn gains(&self, path: &Path, facing: Option<[f64; 3]>) -> PerBand {
        let off_axis = facing.map_or(0.0, |f| f.iter().zip(path.departure).map(|(a, b)| a * b).sum::<f64>() - 1.0);
        std::array::from_fn(|b| {
            let walls: f64 = self.walls.iter().zip(path.hits).map(|(w, n)| w[b].powi(i32::from(n))).product();
            let rest = self.sharpness[b] * off_axis - 0.5 * self.air_per_m[b] * path.length_m;
            let residual = if path.order() > 0 { self.reflections[b] } else { 1.0 };
            residual * walls * rest.exp() / path.length_m
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
        let bands = Bands::new(rate_hz);
        let octaves: Vec<Octave> = fit.octaves.iter().enumerate().map(|(o, f)| f.octave(o)).collect();
        let diffuse = octaves
            .iter()
            .zip(&fit.octaves)
            .map(|(octave, own)| {
                let mut energies = octave.diffuse(&fit.histories, fit.facing);
                let gain = 10f64.powf((own.level_db + own.residual_db) / 10.0);
                let rate = 6.0 * std::f64::consts::LN_10 / measures(&energies, BIN_S)[0];
                let slower = if rate.is_finite() { rate - rate / own.residual_decay } else { 0.0 };
                for (i, e) in energies.iter_mut().enumerate() {
                    *e *= gain * (slower * ((i as f64 + 0.5) * BIN_S - PIVOT_S)).exp();
                }
                energies
            })
            .collect();
        let noise = (0..DRAWS).into_par_iter().map(|seed| Noise::new(&chain.response, length, rate_hz, seed)).collect();
        let samples = ((IMAGES_S * rate_hz) as usize + 2 * chain.response.len()).next_power_of_two();
        Some(Self {
            early: Early::of(&octaves, &fit.octaves.iter().map(|o| o.residual_early_db).collect::<Vec<f64>>(), &bands),
            signal: BandSignal::new(samples, rate_hz, &bands),
            chain,
            walls: fit.walls,
            diffuse,
            noise,
            facing: fit.facing,
            rate_hz,
            length,
        })
    }

    /// The response at a measurement's places, by one draw of noise.
    #[must_use]
    pub fn response(&self, at: &Measurement, draw: usize) -> Vec<f32> {
        let arrival = self.chain.arrival_s(at.distance_m());
        let facing = at.source.facing.filter(|_| self.facing);
        let reach = at.distance_m() + IMAGES_S * SPEED_OF_SOUND_M_S;
        let paths = self.walls.paths(at.source.at_m, at.microphone.at_m, ORDER, reach);
        // The early signal begins with whole samples before the arrival, so that the fraction is in the impulses' times.
        let start = (arrival * self.rate_hz).floor();
        let lead = self.chain.lead as f64 / self.rate_hz;
        let direct_m = paths.first().map_or(0.0, |p| p.length_m);
        let offset = arrival - start / self.rate_hz + 8.0 / self.rate_hz;
        // Where places and walls are not known to a wave's length, images that a symmetric box would add up in step are not in
        // step.
        let mut random = Random::new(draw as u64, 0x696D_6167);
        let known_m = at.source.sd_m.hypot(at.microphone.sd_m);
        let mut time_s = |p: &Path| {
            let off =
                if p.order() == 0 { 0.0 } else { known_m.hypot(WALLS_SD_M * f64::from(p.order()).sqrt()) * random.normal() };
            (offset + (p.length_m - direct_m + off) / SPEED_OF_SOUND_M_S).max(offset)
        };
        let of = Impulses {
            times_s: paths.iter().map(&mut time_s).collect(),
            gains: paths.iter().map(|p| self.early.gains(p, facing)).collect::<Vec<[f64; BANDS]>>(),
        };
        let mut bins = self.signal.spectrum(&of);
        let chain = spectrum(self.chain.response.iter().copied(), self.signal.length());
        bins.iter_mut().zip(&chain).for_each(|(b, c)| *b *= c);
        let early = signal(bins, self.signal.length());
        let mut response = vec![0.0_f32; self.length];
        let first = start as isize - 8 - (lead * self.rate_hz).round() as isize;
        for (i, v) in early.iter().enumerate() {
            if let Some(slot) =
                first.checked_add_unsigned(i).and_then(|k| usize::try_from(k).ok()).and_then(|k| response.get_mut(k))
            {
                *slot += *v as f32;
            }
        }
        let shift = at.distance_m() / SPEED_OF_SOUND_M_S / BIN_S;
        for (octave, energies) in self.diffuse.iter().enumerate() {
            let from = |i: usize| energies.get(i).copied().unwrap_or(0.0);
            let (whole, fraction) = (shift as usize, shift.fract());
            let own: Vec<f64> =
                (0..energies.len()).map(|i| from(i + whole) * (1.0 - fraction) + from(i + whole + 1) * fraction).collect();
            self.noise[draw].add(octave, &mut response, start as usize, &own, BIN_S * self.rate_hz);
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
