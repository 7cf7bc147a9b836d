//! Energy over time as time filters of a scene.

use crate::energy_vector::{EnergyVector, ear_energy};
use crate::scene_head::SceneHead;
use promenade_acoustics::{BANDS, Echogram, centred, octave_energy_from_63};
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
/// The longest reverberation time, seconds: that of hard walls in air alone is longer than any room's.
pub(crate) const LONGEST_T60_S: f64 = 60.0;
/// The fall that it is fitted to at least, dB.
const LEAST_FALL_DB: f64 = 10.0;

/// Energy density per hop and band of one ear, `[hop][band]`.
pub type HopEnergies = Vec<Vec<f64>>;

/// How many hops after the direct sound, which arrives at `direct_s`, a time is.
fn place(time_s: f64, direct_s: f64, hop_s: f64) -> f64 {
    (time_s - direct_s) / hop_s + TAP_LEAD_HOPS
}

/// What a place hears of a room besides direct sound and played images, by hop after the direct sound.
#[derive(Clone, Debug, PartialEq)]
pub struct LateEnergies {
    /// As a head hears them that turns anywhere.
    pub energies: HopEnergies,
    /// Without a head, and where they come from.
    pub vectors: Vec<EnergyVector>,
    /// When the direct sound arrives, seconds.
    direct_s: f64,
}

impl LateEnergies {
    /// Those of an echogram at a place where the direct sound arrives at `direct_s`.
    #[must_use]
    pub fn of(echogram: &Echogram, direct_s: f64, head: &SceneHead) -> Self {
        let found = by_hop(echogram, direct_s, head.grid.hop_s());
        let vector = |hop: &Hop| EnergyVector { energy: hop.octaves.iter().sum(), from: hop.from };
        let vectors: Vec<EnergyVector> = found.iter().map(vector).collect();
        let of_hop = |(hop, vector): (&Hop, &EnergyVector)| -> Vec<f64> {
            let (side, share) = vector.side().unwrap_or_default();
            let (low, octaves) = centred(hop.low, &hop.octaves);
            let energy = |hz: f32| octave_energy_from_63(low, &octaves, f64::from(hz));
            let level = |(hz, level): (&f32, f64)| energy(*hz) * ear_energy(share, level);
            head.bands.centres_hz().iter().zip(head.heard_from(side.z)).map(level).collect()
        };
        Self { energies: found.iter().zip(&vectors).map(of_hop).collect(), vectors, direct_s }
    }

    /// Adds what arrives at one time from one direction, a unit vector: energies at 63 Hz and by octave, without a head, and
    /// what the air leaves of them at a frequency in Hz.
    pub fn add(
        &mut self,
        time_s: f64,
        direction: DVec3,
        (low, octaves): (f64, &[f64; BANDS]),
        head: &SceneHead,
        air: impl Fn(f64) -> f64,
    ) {
        let hop = place(time_s, self.direct_s, head.grid.hop_s()).max(1.0) as usize;
        let Some((bands, vector)) = self.energies.get_mut(hop).zip(self.vectors.get_mut(hop)) else { return };
        let energy: f64 = octaves.iter().sum();
        vector.energy += energy;
        vector.from += energy * direction;
        let heard = head.bands.centres_hz().iter().zip(head.heard_from(direction.z));
        for (sum, (hz, level)) in bands.iter_mut().zip(heard) {
            *sum += level * (octave_energy_from_63(low, octaves, f64::from(*hz)) * air(f64::from(*hz)));
        }
    }
}

/// Energies of a hop by octave and at 63 Hz, and the sum of their directions.
#[derive(Clone, Copy, Default)]
struct Hop {
    octaves: [f64; BANDS],
    low: f64,
    from: DVec3,
}

/// What arrives in each hop after the direct sound.
fn by_hop(echogram: &Echogram, direct_s: f64, hop_s: f64) -> Vec<Hop> {
    let hops = ((echogram.bins.len() as f64 * echogram.bin_s - direct_s) / hop_s).ceil().max(2.0) as usize;
    let mut found = vec![Hop::default(); hops];
    for (i, bin) in echogram.bins.iter().enumerate() {
        // A bin reaches into two hops.
        let place = place(i as f64 * echogram.bin_s, direct_s, hop_s);
        let width = echogram.bin_s / hop_s;
        let first = place.floor();
        let into_next = ((place + width - first - 1.0) / width).clamp(0.0, 1.0);
        for (hop, share) in [(first, 1.0 - into_next), (first + 1.0, into_next)] {
            // What comes with the direct sound is heard a hop later: there is no earlier tap.
            let hop = hop.max(1.0) as usize;
            if let Some(hop) = found.get_mut(hop) {
                hop.low += share * f64::from(bin.energy_63);
                hop.octaves.iter_mut().zip(bin.energy).for_each(|(sum, e)| *sum += share * f64::from(e));
                hop.from += share * DVec3::from(bin.from.map(|axis| axis.iter().map(|e| f64::from(*e)).sum()));
            }
        }
    }
    found
}

/// Taps that cover half of a reverberation time, seconds, between [`SHORTEST_EARLY_S`] and [`LONGEST_EARLY_S`].
#[must_use]
pub fn early_taps(t60_s: f64, hop_s: f64) -> usize {
    ((0.5 * t60_s).clamp(SHORTEST_EARLY_S, LONGEST_EARLY_S) / hop_s).round() as usize
}

/// Reverberation time of the late part by band, seconds: a straight line through the level, at all places together, over what
/// T20 sees of it. `typical` where nothing is left to decay.
pub(crate) fn decay_s(late: &[LateEnergies], from: usize, hop_s: f64, typical: f64) -> Vec<f32> {
    let rest: Vec<&HopEnergies> = late.iter().map(|late| &late.energies).collect();
    let hops = rest.iter().map(|hops| hops.len()).min().unwrap_or(0);
    let bands = rest.first().and_then(|hops| hops.first()).map_or(0, Vec::len);
    let time = |band: usize| {
        let energies: Vec<f64> = (0..hops).map(|hop| rest.iter().map(|h| h[hop][band]).sum::<f64>().max(1e-30)).collect();
        let levels = energies.iter().zip(0..).take(t20_end(&energies, from)).skip(from);
        let points: Vec<(f64, f64)> = levels.map(|(energy, hop)| (f64::from(hop) * hop_s, 10.0 * energy.log10())).collect();
        let db_per_s = if points.len() > 3 { slope(&points) } else { None };
        db_per_s.map(|s| -60.0 / s).filter(|t| t.is_finite() && *t > 0.0).unwrap_or(typical)
    };
    (0..bands).map(|band| time(band).clamp(0.02, LONGEST_T60_S) as f32).collect()
}

/// The hop after the last that T20 sees of energies by hop; from hop `from` on they have fallen by 10 dB until then, if they
/// do.
#[must_use]
pub fn t20_end(energies: &[f64], from: usize) -> usize {
    let nearly_gone = energies.iter().sum::<f64>() * 10.0_f64.powf(0.1 * FITTED_TO_DB);
    let mut left = 0.0;
    let last = energies.iter().rposition(|energy| {
        left += energy;
        left > nearly_gone
    });
    let late = energies.get(from..).unwrap_or(&[]);
    let level = |energy: &f64| 10.0 * energy.log10();
    let start = late.iter().take(4).map(level).sum::<f64>() / late.len().clamp(1, 4) as f64;
    let fallen = late.iter().position(|energy| level(energy) < start - LEAST_FALL_DB);
    last.map_or(0, |last| last + 1).max(fallen.map_or(energies.len(), |fallen| from + fallen))
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

/// Gains of taps and late part, which are the same at both ears, times amplitudes of both ears by band that are asked for by
/// the side that each hop's energy comes from.
#[must_use]
pub fn sided(
    row: &[f32],
    vectors: &[EnergyVector],
    shape: TransferShape,
    ears: impl Fn(&EnergyVector) -> [Vec<f32>; 2],
) -> Vec<f32> {
    let late = vectors.iter().skip(shape.taps + 1).fold(EnergyVector::default(), |sum, vector| EnergyVector {
        energy: sum.energy + vector.energy,
        from: sum.from + vector.from,
    });
    let hops = (1..=shape.taps).map(|hop| vectors.get(hop).copied().unwrap_or_default()).chain([late]);
    let mut row = row.to_vec();
    for (gains, vector) in row.chunks_exact_mut(shape.tap_len()).zip(hops) {
        for (gain, ratio) in gains.iter_mut().zip(ears(&vector).iter().flatten()) {
            *gain *= ratio;
        }
    }
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

    fn late(energy: impl Fn(i32) -> f64) -> LateEnergies {
        LateEnergies { energies: (0..400).map(|hop| vec![energy(hop); 2]).collect(), vectors: Vec::new(), direct_s: 0.0 }
    }

    #[test]
    fn silence_falls_along_no_line() {
        // As above a plane outdoors: some hops, and then nothing for ever.
        let outdoors = late(|hop| if hop < 3 { 1.0 } else { 0.0 });
        assert_eq!(decay_s(&[outdoors], 8, 0.005, 0.3), [0.3; 2]);
        let falling = late(|hop| (-0.1 * f64::from(hop)).exp());
        let t60_s = 0.005 * 60.0 / (10.0 * 0.1 * std::f64::consts::LOG10_E);
        assert!(decay_s(&[falling], 8, 0.005, 0.3).iter().all(|t| (f64::from(*t) / t60_s - 1.0).abs() < 0.01));
    }
}
