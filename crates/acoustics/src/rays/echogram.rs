//! Energy over time.

use crate::materials::air::Air;
use crate::octave::{BANDS, LOW_HZ, OCTAVES_HZ, Octaves, octave_energy_from_63};

/// Least square of the correlation of level and time of what is called a decay; below it there are steps, as of two arrivals.
/// ISO 3382-2 takes 0.99 for a measured one.
const LEAST_CORRELATION: f64 = 0.8;

/// Octaves side by side in a vector: those of scenes, then that at 63 Hz.
pub(crate) const LANES: usize = BANDS + 1;
/// The lane of 63 Hz.
pub(crate) const LOW_LANE: usize = BANDS;

/// What the air takes of the energy in each lane, per metre, as [`Air::decay_per_m`] has it.
pub(crate) fn lanes_decay_per_m(air: Option<Air>) -> [f64; LANES] {
    let Some(air) = air else { return [0.0; LANES] };
    std::array::from_fn(|lane| air.energy_decay_per_m(OCTAVES_HZ.get(lane).map_or(LOW_HZ, |hz| f64::from(*hz))))
}

/// Energy that arrives at a listener over time, from all sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Echogram {
    /// Length of a bin, seconds; the first begins when the source sounds.
    pub bin_s: f64,
    /// Bins one after the other.
    pub bins: Vec<Bin>,
}

/// What arrives within a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bin {
    /// Energy, where that of the direct sound at 1 m is 1.
    pub energy: Octaves,
    /// That of the octave at 63 Hz.
    pub energy_63: f32,
    /// Its parts along x, y and z: energy times the direction that it comes from, as long as the energy if all comes from one
    /// side and 0 if as much comes from every side.
    pub from: [Octaves; 3],
}

impl Echogram {
    pub(crate) fn new(bin_s: f64, bins: &[Lanes], air: impl Fn(usize, usize) -> f32) -> Self {
        let bin = |(i, lanes): (usize, &Lanes)| {
            let octaves = |row: &[f32; LANES]| std::array::from_fn::<f32, BANDS, _>(|b| row[b] * air(i, b));
            let [energy, x, y, z] = lanes.0.each_ref().map(octaves);
            Bin { energy, energy_63: lanes.0[0][LOW_LANE] * air(i, LOW_LANE), from: [x, y, z] }
        };
        Self { bin_s, bins: bins.iter().enumerate().map(bin).collect() }
    }

    /// Adds energy at a time, seconds, from a direction of unit length, at 63 Hz as much as at 125; what comes after the end is
    /// lost.
    pub fn add(&mut self, time_s: f64, energy: &Octaves, from: [f64; 3]) {
        let Some(bin) = self.bins.get_mut((time_s / self.bin_s) as usize) else { return };
        bin.energy_63 += energy[0];
        for (band, e) in energy.iter().enumerate() {
            bin.energy[band] += e;
            bin.from.iter_mut().zip(from).for_each(|(sum, axis)| sum[band] += e * axis as f32);
        }
    }

    /// Energy of an octave over all bins.
    #[must_use]
    pub fn energy(&self, band: usize) -> f64 {
        self.bins.iter().map(|bin| f64::from(bin.energy[band])).sum()
    }

    /// Reverberation time of an octave, seconds, from the decay between -5 and -35 dB (ISO 3382-1, T30); `None` where the
    /// echogram does not reach so far, or falls in steps instead of along a line.
    #[must_use]
    pub fn t30_s(&self, band: usize) -> Option<f64> {
        self.decay_time_s(band, -35.0)
    }

    /// Reverberation time of an octave, seconds, from the decay between -5 and -25 dB (T20); `None` where [`Self::t30_s`] has
    /// none.
    #[must_use]
    pub fn t20_s(&self, band: usize) -> Option<f64> {
        self.decay_time_s(band, -25.0)
    }

    fn decay_time_s(&self, band: usize, end_db: f64) -> Option<f64> {
        decay_time_s(&self.lane(band), self.bin_s, end_db)
    }

    /// Energy of an octave, or of that at 63 Hz, by bin.
    fn lane(&self, lane: usize) -> Vec<f64> {
        self.bins.iter().map(|bin| f64::from(bin.energy.get(lane).copied().unwrap_or(bin.energy_63))).collect()
    }
}

/// T20 at a frequency from 63 to 500 Hz, seconds, that echograms of one length show together, as [`octave_energy_from_63`] has
/// energies; `None` where an octave of them shows none.
#[must_use]
pub fn low_t20_s(echograms: &[Echogram]) -> Option<impl Fn(f64) -> f64 + use<>> {
    let of = |lane: usize| {
        let mut sums = echograms.first()?.lane(lane);
        for echogram in &echograms[1..] {
            sums.iter_mut().zip(echogram.lane(lane)).for_each(|(sum, energy)| *sum += energy);
        }
        decay_time_s(&sums, echograms[0].bin_s, -25.0)
    };
    let (low, known) = (of(LOW_LANE)?, [of(0)?, of(1)?, of(2)?]);
    let octaves: [f64; BANDS] = std::array::from_fn(|band| known[band.min(2)]);
    Some(move |hz| octave_energy_from_63(low, &octaves, hz))
}

/// Reverberation time of energies by bins of some seconds, seconds, from the line of least squares through their backward
/// integral between -5 dB and `end_db`; `None` where they do not fall so far, or fall in steps instead of along a line.
#[must_use]
pub fn decay_time_s(energies: &[f64], bin_s: f64, end_db: f64) -> Option<f64> {
    let mut left = energies.to_vec();
    let mut sum = 0.0;
    for l in left.iter_mut().rev() {
        sum += *l;
        *l = sum;
    }
    let points: Vec<(f64, f64)> = left
        .iter()
        .zip(0..)
        .map(|(l, i)| (f64::from(i) * bin_s, 10.0 * (l / sum).log10()))
        .filter(|(_, db)| (end_db..=-5.0).contains(db))
        .collect();
    if sum <= 0.0 || points.len() < 3 || left.last().is_none_or(|l| 10.0 * (l / sum).log10() > end_db) {
        return None;
    }
    let count = points.len() as f64;
    let (t, db) = (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
    let (both, times, levels) = (sum(&|p| (p.0 - t) * (p.1 - db)), sum(&|p| (p.0 - t).powi(2)), sum(&|p| (p.1 - db).powi(2)));
    let straight = both * both >= LEAST_CORRELATION * times * levels;
    let t60_s = -60.0 * times / both;
    (straight && t60_s.is_finite() && t60_s > 0.0).then_some(t60_s)
}

/// A bin while rays are collected: energy, and its parts along x, y and z.
#[derive(Clone, Copy, Default)]
pub(crate) struct Lanes([[f32; LANES]; 4]);

impl Lanes {
    pub(crate) fn collect(&mut self, energy: &[f32; LANES], scale: f32, [x, y, z]: [f32; 3]) {
        for (row, weight) in self.0.iter_mut().zip([1.0, x, y, z]) {
            row.iter_mut().zip(energy).for_each(|(sum, e)| *sum += e * (scale * weight));
        }
    }

    /// Without directions.
    #[cfg(feature = "meshes")]
    pub(crate) fn of_energy(energy: &[f32; LANES]) -> Self {
        Self([*energy, [0.0; LANES], [0.0; LANES], [0.0; LANES]])
    }

    #[cfg(feature = "meshes")]
    pub(crate) fn add(&mut self, other: &Self) {
        self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()).for_each(|(a, b)| *a += b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echogram(energy: impl Fn(usize) -> f32) -> Echogram {
        let bin = |i| Bin { energy: [energy(i); BANDS], energy_63: energy(i), from: [[0.0; BANDS]; 3] };
        Echogram { bin_s: 0.004, bins: (0..250).map(bin).collect() }
    }

    #[test]
    fn steps_and_what_does_not_fall_are_no_decay() {
        // -5.2 dB after the first arrival, and then nothing falls until the second: a line through that is level.
        let two = echogram(|i| {
            if i == 3 {
                0.7
            } else if i == 200 {
                0.3
            } else {
                0.0
            }
        });
        let (once, silent, level) = (echogram(|i| if i == 3 { 1.0 } else { 0.0 }), echogram(|_| 0.0), echogram(|_| 1.0));
        for echogram in [two, once, silent] {
            assert_eq!((echogram.t20_s(2), echogram.t30_s(2)), (None, None));
        }
        assert!(level.t20_s(2).is_none_or(|t| t.is_finite() && t > 0.0));
        let falling = echogram(|i| (-0.1 * i as f32).exp());
        assert!((falling.t20_s(2).unwrap() / (0.004 * 60.0 / (10.0 * 0.1 * std::f64::consts::LOG10_E)) - 1.0).abs() < 0.01);
    }
}
