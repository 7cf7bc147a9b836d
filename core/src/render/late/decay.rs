//! A room's decay made longer or shorter than the scene's.

use crate::bands::BandPlace;
use crate::number::{exponent, single};
use crate::render::carrier::noise::per_bin;
use crate::render::late::decay_curve::DecayCurve;
use crate::render::transform::lanes::{LANES, blocks_for};
use crate::{StftGrid, TAP_LEAD_HOPS, TailModel};
use std::sync::Arc;

/// The least amplitude that the late part leaves after one hop: its gains are stated some hops after it begins, and a room that
/// has fallen silent by then says nothing of how loud it was.
const FASTEST: f64 = 0.1;
/// Half of a tap's hop has passed so many hops after its time.
const MIDDLE_OF_A_HOP: f64 = 0.5 - TAP_LEAD_HOPS;

/// Gains that make a room's decay longer or shorter.
pub(crate) struct Decay {
    curve: Arc<DecayCurve>,
    taps: usize,
    /// Amplitude that the late part leaves after one hop as the scene has it, per band and per bin.
    stated: Vec<f64>,
    stated_bins: Vec<f64>,
    places: Vec<BandPlace>,
    /// As it is wanted, per band, and its ratio to what is stated.
    wanted: Vec<f64>,
    ratio: Vec<f64>,
    /// That ratio per bin, in whole blocks.
    ratio_bins: Vec<f32>,
    /// Gains of each tap, and of the late part where it is stated, `[hop][band]`.
    gains: Vec<f32>,
    /// Reverberation time as a multiple of the scene's.
    times: f32,
    scaled: Vec<f32>,
}

impl Decay {
    pub(crate) fn new(grid: &StftGrid, tail: &TailModel, places: &[BandPlace], curve: Arc<DecayCurve>, taps: usize) -> Self {
        let hop = |t60_s: &f32| 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(*t60_s)).max(FASTEST);
        let stated: Vec<f64> = tail.t60_s.iter().map(hop).collect();
        Self {
            curve,
            taps,
            stated_bins: per_bin(places, &stated),
            places: places.to_vec(),
            wanted: stated.clone(),
            ratio: vec![1.0; stated.len()],
            ratio_bins: vec![1.0; blocks_for(places.len()) * LANES],
            gains: vec![1.0; (taps + 1) * stated.len()],
            times: 1.0,
            scaled: vec![0.0; 2 * stated.len()],
            stated,
        }
    }

    /// What is left after one hop in each bin of a room as the scene has it.
    pub(crate) fn stated_bins(&self) -> &[f64] {
        &self.stated_bins
    }

    /// What is left after one hop in each band of a room as the scene has it, and by how much more is wanted.
    pub(crate) fn hops(&self) -> impl Iterator<Item = (f64, f64)> {
        self.stated.iter().copied().zip(self.ratio.iter().copied())
    }

    /// By how much more than in the scene that is, per bin, in whole blocks.
    pub(crate) fn ratio_bins(&self) -> &[f32] {
        &self.ratio_bins
    }

    /// Sets the reverberation time as a multiple of the scene's. Returns whether it has changed.
    pub(crate) fn set(&mut self, times: f32) -> bool {
        if times == self.times {
            return false;
        }
        self.times = times;
        let times = f64::from(times);
        for (band, ((wanted, ratio), stated)) in self.wanted.iter_mut().zip(&mut self.ratio).zip(&self.stated).enumerate() {
            *wanted = if times == 1.0 { *stated } else { (0.5 * self.curve.late_slope(band, times)).exp().max(FASTEST) };
            *ratio = *wanted / stated;
        }
        for ((ratio, place), stated) in self.ratio_bins.iter_mut().zip(&self.places).zip(&self.stated_bins) {
            let (low, high) = (self.wanted[place.band], self.wanted[place.band + 1]);
            *ratio = single((low + f64::from(place.fraction) * (high - low)) / stated);
        }
        for (hop, gains) in self.gains.chunks_exact_mut(self.stated.len()).enumerate() {
            let middle = if hop < self.taps { MIDDLE_OF_A_HOP } else { 0.0 };
            for (band, gain) in gains.iter_mut().enumerate() {
                *gain = single(self.curve.log_gain(band, (hop + 1) as f64 + middle, times).exp());
            }
        }
        true
    }

    /// Gains of what comes some hops after the direct sound, at least one, both ears, from those that the scene states.
    pub(crate) fn gains<'a>(&'a mut self, stated: &'a [f32], hops: usize) -> &'a [f32] {
        if self.times == 1.0 {
            return stated;
        }
        let bands = self.ratio.len();
        let row = hops.min(self.taps + 1);
        let gains = &self.gains[(row - 1) * bands..row * bands];
        for (scaled, stated) in self.scaled.chunks_exact_mut(bands).zip(stated.chunks_exact(bands)) {
            for (((scaled, stated), gain), ratio) in scaled.iter_mut().zip(stated).zip(gains).zip(&self.ratio) {
                *scaled = stated * gain * single(ratio.powi(exponent(hops - row)));
            }
        }
        &self.scaled
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.stated_bins)
            + size_of_val(&*self.places)
            + size_of_val(&*self.ratio_bins)
            + size_of_val(&*self.gains)
    }
}
