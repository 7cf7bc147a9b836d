//! Energy over time as time filters of a scene.

use crate::receiver::Receiver;
use promenade_acoustics::{BANDS, Echogram, octave_energy};
use promenade_core::glam::DVec3;
use promenade_core::{TAP_LEAD_HOPS, TransferShape};
use promenade_metrics::slope;
use std::ops::Range;

/// The longest and shortest time after the direct sound that taps cover, seconds.
pub const LONGEST_EARLY_S: f64 = 0.22;
/// See [`LONGEST_EARLY_S`].
pub const SHORTEST_EARLY_S: f64 = 0.08;
/// The late part's reverberation time is fitted to where less is still to come than this, dB of all energy: the end of T20 (ISO
/// 3382-1).
const FITTED_TO_DB: f64 = -25.0;
/// The fall that it is fitted to at least, dB.
const LEAST_FALL_DB: f64 = 10.0;

/// Energy density per hop and band of one ear, `[hop][band]`.
pub type HopEnergies = Vec<Vec<f64>>;

/// How many hops after the direct sound, which arrives at `direct_s`, a time is.
fn place(time_s: f64, direct_s: f64, hop_s: f64) -> f64 {
    (time_s - direct_s) / hop_s + TAP_LEAD_HOPS
}

/// An echogram as a head hears it that turns anywhere, as energy per hop after the direct sound, which arrives at `direct_s`,
/// and band. What of a hop comes from one side has the head's level at its elevation; the rest comes from everywhere, where
/// that is 1.
#[must_use]
pub fn hop_energies(echogram: &Echogram, direct_s: f64, head: &Receiver) -> HopEnergies {
    let bands = &head.bands;
    let of_hop = |(octaves, from): &([f64; BANDS], DVec3)| -> Vec<f64> {
        let share = (from.length() / octaves.iter().sum::<f64>().max(1e-300)).min(1.0);
        let heard = head.heard_from(from.normalize_or_zero().z);
        let level = |(hz, heard): (&f32, f64)| octave_energy(octaves, f64::from(*hz)) * (1.0 - share + share * heard);
        bands.centres_hz().iter().zip(heard).map(level).collect()
    };
    by_hop(echogram, direct_s, head.grid.hop_s()).iter().map(of_hop).collect()
}

/// Energy of all octaves together that arrives in a hop, and the sum of the directions that it comes from, each as long as its
/// energy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow {
    /// Without a head.
    pub energy: f64,
    /// World; as long as the energy where all of it comes from one direction.
    pub from: DVec3,
}

/// Where the energy of an echogram comes from, by hop after the direct sound as [`hop_energies`] has them.
#[must_use]
pub fn hop_flows(echogram: &Echogram, direct_s: f64, hop_s: f64) -> Vec<Flow> {
    let flow = |(octaves, from): ([f64; BANDS], DVec3)| Flow { energy: octaves.iter().sum(), from };
    by_hop(echogram, direct_s, hop_s).into_iter().map(flow).collect()
}

/// Adds what arrives at one time from one direction, a unit vector.
pub fn add_flow(flows: &mut [Flow], [time_s, direct_s]: [f64; 2], hop_s: f64, direction: DVec3, energy: f64) {
    if let Some(flow) = flows.get_mut(place(time_s, direct_s, hop_s).max(1.0) as usize) {
        flow.energy += energy;
        flow.from += energy * direction;
    }
}

/// Energies by octave, and the sum of their directions, by hop after the direct sound.
fn by_hop(echogram: &Echogram, direct_s: f64, hop_s: f64) -> Vec<([f64; BANDS], DVec3)> {
    let hops = ((echogram.bins.len() as f64 * echogram.bin_s - direct_s) / hop_s).ceil().max(2.0) as usize;
    let mut found = vec![([0.0_f64; BANDS], DVec3::ZERO); hops];
    for (i, bin) in echogram.bins.iter().enumerate() {
        // A bin reaches into two hops.
        let place = place(i as f64 * echogram.bin_s, direct_s, hop_s);
        let width = echogram.bin_s / hop_s;
        let first = place.floor();
        let into_next = ((place + width - first - 1.0) / width).clamp(0.0, 1.0);
        for (hop, share) in [(first, 1.0 - into_next), (first + 1.0, into_next)] {
            // What comes with the direct sound is heard a hop later: there is no earlier tap.
            let hop = hop.max(1.0) as usize;
            if let Some((octaves, from)) = found.get_mut(hop) {
                octaves.iter_mut().zip(bin.energy).for_each(|(sum, e)| *sum += share * f64::from(e));
                *from += share * DVec3::from(bin.from.map(|axis| axis.iter().map(|e| f64::from(*e)).sum()));
            }
        }
    }
    found
}

/// Adds what arrives at one time from one elevation, whose sine is given: `energy` is that of a frequency in Hz, without a
/// head.
pub fn add_arrival(
    energies: &mut HopEnergies,
    [time_s, direct_s]: [f64; 2],
    sine: f64,
    head: &Receiver,
    energy: impl Fn(f64) -> f64,
) {
    let hop = place(time_s, direct_s, head.grid.hop_s()).max(1.0) as usize;
    let Some(bands) = energies.get_mut(hop) else { return };
    let heard = head.bands.centres_hz().iter().zip(head.heard_from(sine));
    bands.iter_mut().zip(heard).for_each(|(sum, (hz, heard))| *sum += heard * energy(f64::from(*hz)));
}

/// Reverberation time of the late part by band, seconds: a straight line through the level, at all places together, over what
/// T20 sees of it. `typical` where nothing is left to decay.
#[must_use]
pub fn decay_s(rest: &[HopEnergies], from: usize, hop_s: f64, typical: f64) -> Vec<f32> {
    let hops = rest.iter().map(Vec::len).min().unwrap_or(0);
    let bands = rest.first().and_then(|hops| hops.first()).map_or(0, Vec::len);
    let time = |band: usize| {
        let energies: Vec<f64> = (0..hops).map(|hop| rest.iter().map(|h| h[hop][band]).sum::<f64>().max(1e-30)).collect();
        // Silence falls along no line.
        if energies.iter().skip(from).all(|energy| *energy <= 1e-30) {
            return typical;
        }
        let nearly_gone = energies.iter().sum::<f64>() * 10.0_f64.powf(0.1 * FITTED_TO_DB);
        let mut left = 0.0;
        let last = energies.iter().rposition(|energy| {
            left += energy;
            left > nearly_gone
        });
        let levels: Vec<f64> = energies.iter().skip(from).map(|energy| 10.0 * energy.log10()).collect();
        let start = levels.iter().take(4).sum::<f64>() / levels.len().clamp(1, 4) as f64;
        let fallen = levels.iter().position(|level| *level < start - LEAST_FALL_DB).unwrap_or(levels.len());
        let end = fallen.max(last.map_or(0, |last| (last + 1).saturating_sub(from))).min(levels.len());
        let points: Vec<(f64, f64)> = levels[..end].iter().enumerate().map(|(i, level)| (i as f64 * hop_s, *level)).collect();
        let db_per_s = if points.len() > 3 { slope(&points) } else { None };
        db_per_s.map(|s| -60.0 / s).filter(|t| t.is_finite() && *t > 0.0).unwrap_or(typical)
    };
    (0..bands).map(|band| time(band).clamp(0.02, 100.0) as f32).collect()
}

/// Gains of taps and late part of one place in a row, linear amplitude, the same at both ears.
#[must_use]
pub fn time_filters(energies: &[Vec<f64>], unit: &[Vec<f64>], shape: TransferShape, gain: f64) -> Vec<f32> {
    let mut row = Vec::with_capacity(shape.tap_len() * (shape.taps + 1));
    for hop in 1..=shape.taps {
        let one = |band: usize| energies.get(hop).map_or(0.0, |e| (gain * e[band].sqrt()) as f32);
        let ear: Vec<f32> = (0..shape.bands).map(one).collect();
        row.extend([&ear[..], &ear[..]].concat());
    }
    let first = shape.taps + 1;
    let until = energies.len().min(unit.len());
    let late = |band: usize| {
        if until > first + 2 { (gain * late_gain(energies, unit, band, first..until)) as f32 } else { 0.0 }
    };
    let ear: Vec<f32> = (0..shape.bands).map(late).collect();
    row.extend([&ear[..], &ear[..]].concat());
    leave_to_late(&mut row, unit, shape);
    row
}

/// Takes from the last taps what the late part has there already.
fn leave_to_late(row: &mut [f32], unit: &[Vec<f64>], shape: TransferShape) {
    let (taps, late) = row.split_at_mut(shape.tap_len() * shape.taps);
    for (gains, unit) in taps.chunks_exact_mut(shape.tap_len()).zip(unit.iter().skip(1)) {
        for ((gain, late), unit) in gains.iter_mut().zip(&*late).zip(unit.iter().chain(unit)) {
            *gain = (*gain * *gain - late * late * *unit as f32).max(0.0).sqrt();
        }
    }
}

/// Gain of the late part in a band, linear amplitude, that has all of the energy over some hops; `unit` is that of a gain of 1.
#[must_use]
pub fn late_gain(energies: &[Vec<f64>], unit: &[Vec<f64>], band: usize, hops: Range<usize>) -> f64 {
    let over = |of: &[Vec<f64>]| of[hops.clone()].iter().map(|hop| hop[band]).sum::<f64>();
    let played = over(unit);
    if played > 0.0 { (over(energies) / played).max(0.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_falls_along_no_line() {
        // As above a plane outdoors: some hops, and then nothing for ever.
        let outdoors: HopEnergies = (0..400).map(|hop| vec![if hop < 3 { 1.0 } else { 0.0 }; 2]).collect();
        assert_eq!(decay_s(&[outdoors], 8, 0.005, 0.3), [0.3; 2]);
        let falling: HopEnergies = (0..400).map(|hop| vec![(-0.1 * f64::from(hop)).exp(); 2]).collect();
        let t60_s = 0.005 * 60.0 / (10.0 * 0.1 * std::f64::consts::LOG10_E);
        assert!(decay_s(&[falling], 8, 0.005, 0.3).iter().all(|t| (f64::from(*t) / t60_s - 1.0).abs() < 0.01));
    }
}
