//! Energy over time as time filters of a scene.

use promenade_acoustics::{Echogram, octave_energy};
use promenade_core::{Bands, StftGrid, TailModel, TransferShape};
use promenade_metrics::slope;
use std::ops::Range;

/// The longest and shortest time after the direct sound that taps cover, seconds.
pub const LONGEST_EARLY_S: f64 = 0.22;
/// See [`LONGEST_EARLY_S`].
pub const SHORTEST_EARLY_S: f64 = 0.08;
/// The fall of the late part that its reverberation time is fitted to, dB.
const FITTED_DB: f64 = 20.0;

/// Energy density per hop and band of one ear, `[hop][band]`.
pub type HopEnergies = Vec<Vec<f64>>;

/// An echogram as energy per hop after the direct sound, which arrives at `direct_s`, and band.
#[must_use]
pub fn hop_energies(echogram: &Echogram, direct_s: f64, grid: &StftGrid, bands: &Bands) -> HopEnergies {
    // Hop `l` begins a quarter of a hop before `l` hops after the direct sound, as the render head's taps do.
    let start = direct_s - 0.25 * grid.hop_s();
    let hops = ((echogram.bins.len() as f64 * echogram.bin_s - direct_s) / grid.hop_s()).ceil().max(2.0) as usize;
    let mut octaves = vec![[0.0_f64; 7]; hops];
    for (i, bin) in echogram.bins.iter().enumerate() {
        // A bin reaches into two hops.
        let place = (i as f64 * echogram.bin_s - start) / grid.hop_s();
        let width = echogram.bin_s / grid.hop_s();
        let first = place.floor();
        let into_next = ((place + width - first - 1.0) / width).clamp(0.0, 1.0);
        for (hop, share) in [(first, 1.0 - into_next), (first + 1.0, into_next)] {
            // What comes with the direct sound is heard a hop later: there is no earlier tap.
            let hop = hop.max(1.0) as usize;
            if let Some(octaves) = octaves.get_mut(hop) {
                octaves.iter_mut().zip(bin.energy).for_each(|(sum, e)| *sum += share * f64::from(e));
            }
        }
    }
    let centres = bands.centres_hz();
    octaves.iter().map(|octaves| centres.iter().map(|hz| octave_energy(octaves, f64::from(*hz))).collect()).collect()
}

/// Reverberation time of the late part by band, seconds: a straight line through the level over its first [`FITTED_DB`], at all places
/// together. `typical` where nothing is left to decay.
#[must_use]
pub fn decay_s(rest: &[HopEnergies], from: usize, hop_s: f64, typical: f64) -> Vec<f32> {
    let hops = rest.iter().map(Vec::len).min().unwrap_or(0);
    let bands = rest.first().and_then(|hops| hops.first()).map_or(0, Vec::len);
    let time = |band: usize| {
        let levels: Vec<f64> =
            (from..hops).map(|hop| 10.0 * rest.iter().map(|h| h[hop][band]).sum::<f64>().max(1e-30).log10()).collect();
        let start = levels.iter().take(4).sum::<f64>() / levels.len().clamp(1, 4) as f64;
        let end = levels.iter().position(|level| *level < start - FITTED_DB).unwrap_or(levels.len());
        let points: Vec<(f64, f64)> = levels[..end].iter().enumerate().map(|(i, level)| (i as f64 * hop_s, *level)).collect();
        let db_per_s = if points.len() > 3 { slope(&points) } else { None };
        db_per_s.map(|s| -60.0 / s).filter(|t| t.is_finite() && *t > 0.0).unwrap_or(typical)
    };
    (0..bands).map(|band| time(band).clamp(0.02, 100.0) as f32).collect()
}

/// Gains of taps and late part of one place in a row, linear amplitude, the same at both ears.
#[must_use]
pub fn time_filters(
    energies: &[Vec<f64>],
    unit: &[Vec<f64>],
    shape: TransferShape,
    tail: &TailModel,
    grid: &StftGrid,
    gain: f64,
) -> Vec<f32> {
    let mut row = Vec::with_capacity(shape.tap_len() * (shape.taps + 1));
    for hop in 1..=shape.taps {
        let one = |band: usize| energies.get(hop).map_or(0.0, |e| (gain * e[band].sqrt()) as f32);
        let ear: Vec<f32> = (0..shape.bands).map(one).collect();
        row.extend([&ear[..], &ear[..]].concat());
    }
    let first = shape.taps + 1;
    let until = energies.len().min(unit.len());
    let late = |band: usize| {
        let decay = 10.0_f64.powf(-3.0 * grid.hop_s() / f64::from(tail.t60_s[band]));
        if until > first + 2 { (gain * late_gain(energies, unit, band, first..until, decay)) as f32 } else { 0.0 }
    };
    let ear: Vec<f32> = (0..shape.bands).map(late).collect();
    row.extend([&ear[..], &ear[..]].concat());
    row
}

/// Gain of the late part in a band, linear amplitude, from energies over some hops, weighted as they decay; `unit` are those of a gain of
/// 1.
#[must_use]
pub fn late_gain(energies: &[Vec<f64>], unit: &[Vec<f64>], band: usize, hops: Range<usize>, decay_per_hop: f64) -> f64 {
    let (mut num, mut den) = (0.0, 0.0);
    for (l, (e, u)) in energies[hops.clone()].iter().zip(&unit[hops]).enumerate() {
        let weight = decay_per_hop.powi(2 * l as i32);
        num += e[band] * weight;
        den += u[band] * weight;
    }
    if den > 0.0 { (num / den).max(0.0).sqrt() } else { 0.0 }
}
