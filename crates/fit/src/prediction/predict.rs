//! Responses of a fitted room at any place.

use super::room_model::{Arrival, RoomModel};
use crate::bands::{BANDS, Bands, PerBand};
use crate::early::{BandSignal, Chain, Impulses};
use crate::late::{BIN_S, Noise};
use crate::measurements::{Figures, Measurement, Measurements};
use crate::numerics::Random;
use promenade_fourier::{signal, spectrum};
use rayon::prelude::*;

/// Images farther than this behind the direct sound are left to the tail, seconds.
const IMAGES_S: f64 = 0.17;
/// Samples before the direct sound in which bands of low frequencies ring, and those of them that are kept.
const RINGS: (usize, usize) = (512, 32);
/// How far walls are from where they are said to be, and from being flat, as a standard deviation, metres.
const WALLS_SD_M: f64 = 0.02;
/// Draws of noise that figures are the mean of.
const DRAWS: u64 = 8;

/// A fitted room as an instrument.
pub struct Prediction<'a> {
    model: &'a dyn RoomModel,
    /// Amplitudes of the direct sound and of all reflections over what chain and surfaces make of them.
    amplitudes: [PerBand; 2],
    bands: Bands,
    signal: BandSignal,
    chain: Chain,
    /// Energies by bin since the source sounded, by octave, with the source's level.
    diffuse: Vec<Vec<f64>>,
    noise: Vec<Noise>,
    rate_hz: f64,
    length: usize,
}

impl<'a> Prediction<'a> {
    /// Of a room and the measurements that it was fitted to; `None` of no measurements. Responses are as long as the longest of
    /// them.
    #[must_use]
    pub fn new(model: &'a dyn RoomModel, set: &Measurements) -> Option<Self> {
        let rate_hz = f64::from(set.sample_rate_hz);
        let length = set.all.iter().map(|m| m.samples.len()).max().unwrap_or(0);
        let chain = model.chain(set)?;
        let noise = (0..DRAWS).into_par_iter().map(|seed| Noise::new(&chain.response, length, rate_hz, seed)).collect();
        let samples = ((IMAGES_S * rate_hz) as usize + 2 * chain.response.len() + 2 * RINGS.0).next_power_of_two();
        let bands = Bands::new(rate_hz);
        let signal = BandSignal::new(samples, rate_hz, &bands);
        let (amplitudes, diffuse) = (model.residual().amplitudes(&bands), model.late_energies(set));
        Some(Self { model, amplitudes, bands, signal, chain, diffuse, noise, rate_hz, length })
    }

    /// The response at a measurement's places, by one draw of noise.
    #[must_use]
    pub fn response(&self, at: &Measurement, draw: usize) -> Vec<f32> {
        let mut response = self.images(at, draw, &self.amplitudes);
        let start = self.arrival(at);
        for octave in 0..self.diffuse.len() {
            let mut energies = self.rays(at, octave);
            energies.iter_mut().enumerate().for_each(|(bin, e)| *e *= self.model.residual().at(octave, bin));
            self.noise[draw].add(octave, &mut response, start, &energies, BIN_S * self.rate_hz);
        }
        response
    }

    /// The sample at which the direct sound of a measurement is predicted.
    pub(super) fn arrival(&self, at: &Measurement) -> usize {
        (self.chain.arrival_s(at.distance_m()) * self.rate_hz).floor() as usize
    }

    /// Energies of diffuse sound in an octave by bin since the direct sound, without the residual.
    pub(super) fn rays(&self, at: &Measurement, octave: usize) -> Vec<f64> {
        let energies = &self.diffuse[octave];
        let shift = at.distance_m() / self.chain.speed_m_s / BIN_S;
        let from = |i: usize| energies.get(i).copied().unwrap_or(0.0);
        let (whole, fraction) = (shift as usize, shift.fract());
        (0..energies.len()).map(|i| from(i + whole) * (1.0 - fraction) + from(i + whole + 1) * fraction).collect()
    }

    /// The direct sound and all images, each times its amplitudes by band.
    pub(super) fn images(&self, at: &Measurement, draw: usize, amplitudes: &[PerBand; 2]) -> Vec<f32> {
        let arrival = self.chain.arrival_s(at.distance_m());
        let arrivals = self.model.arrivals(at, &self.bands, at.distance_m() + IMAGES_S * self.chain.speed_m_s);
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
    pub fn figures(&self, at: &Measurement) -> Option<Figures> {
        let all: Vec<Figures> = (0..self.noise.len()).map(|draw| Figures::of(&self.response(at, draw), self.rate_hz)).collect();
        Figures::mean(&all)
    }
}
