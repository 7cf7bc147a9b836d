//! How a room's sound dies away where its scene starts, band by band: what a longer or shorter decay is a stretch of.

use crate::decode::field::heard;
use crate::number::{single, whole};
use crate::octave::nearest_octave;
use crate::render::late::network::{late_gain, late_lead, late_share};
use crate::{Bands, NEAREST_M, Scene, Shares, StftGrid, TAP_LEAD_HOPS, TailModel};

/// Less energy than that is none.
const NOTHING: f64 = 1e-24;

/// The end of T20 (ISO 3382-1), 25 dB, and 10 dB, natural logarithms of energies.
const T20_END: f64 = 2.5 * std::f64::consts::LN_10;
const LEAST_FALL: f64 = std::f64::consts::LN_10;
/// Quarters of a response in which its end does not yet bend what is still to come.
const WHOLE_OF_4: usize = 3;

/// Energy that is still to come, by time after the direct sound (Schroeder 1965: backward integration).
#[derive(Debug)]
pub(crate) struct DecayCurve {
    /// Natural logarithm of the energy from a hop on, `[hop][band]`, from the first hop after the direct sound to the first of
    /// the late part.
    levels: Vec<f32>,
    /// What a hop takes of it afterwards, by band.
    slopes: Vec<f32>,
}

impl DecayCurve {
    /// One exponential per band.
    pub(crate) fn exponential(tail: &TailModel, hop_s: f64, taps: usize) -> Self {
        let slopes = slopes(tail, hop_s);
        let levels = (0..=taps).flat_map(|hop| slopes.iter().map(move |slope| slope * hop as f32)).collect();
        Self { levels, slopes }
    }

    /// That of a scene's time filters and image sources; of its late part alone where it has no table of them. `carried` is the
    /// energy by band that a tap's carriers have, each with its share, at a gain of 1.
    pub(crate) fn of_scene(scene: &Scene, grid: &StftGrid, carried: impl Fn(usize, &Shares) -> Vec<f64>) -> Self {
        let (parts, pose) = (scene.parts(), scene.start_pose());
        let (taps, bands) = (parts.taps, parts.bands.count());
        let Some(heard) = heard(scene, &pose) else {
            return Self::exponential(&parts.tail, grid.hop_s(), taps);
        };
        let power =
            |gains: &[f32], band: usize| 0.5 * (f64::from(gains[band]).powi(2) + f64::from(gains[bands + band]).powi(2));
        let mut energy = vec![0.0; (taps + 1) * bands];
        for (hop, gains) in heard.taps.chunks_exact(2 * bands).enumerate() {
            let carried = carried(hop, &heard.shares);
            (0..bands).for_each(|band| energy[hop * bands + band] = power(gains, band) * carried.get(band).unwrap_or(&0.0));
        }
        if let Some((images, emitter)) = parts.images.as_ref().zip(scene.emitter()).filter(|_| taps > 0) {
            let hop_m = grid.hop_s() * f64::from(scene.weather().speed_m_s());
            let mut seen = vec![0.0; images.images.len()];
            images.seen_at(pose.position, scene.corners(), &mut seen);
            let all = images.images.iter().zip(seen).enumerate().filter(|(_, (image, _))| image.position != emitter);
            for (number, (image, seen)) in all {
                let sent = images.sent(number, &pose).unwrap_or_default();
                let distance = pose.position.distance(image.position);
                let after = f64::from(distance - pose.position.distance(emitter)) / hop_m;
                let hop = whole(after + TAP_LEAD_HOPS).clamp(1, taps) - 1;
                for (band, hz) in parts.bands.centres_hz().iter().enumerate() {
                    let octave = nearest_octave(*hz);
                    let air = 10.0_f32.powf(-0.05 * distance * images.air_db_per_m[octave]);
                    let gain = seen * image.gains[octave] * sent[octave].exp() * air / distance.max(NEAREST_M);
                    energy[hop * bands + band] += f64::from(gain).powi(2);
                }
            }
        }
        let slopes = slopes(&parts.tail, grid.hop_s());
        for band in 0..bands {
            let hop = f64::from(slopes[band]).exp();
            let late = power(&heard.late, band);
            energy[taps * bands + band] = NOTHING.max(late / (1.0 - hop).max(NOTHING));
            // The late part begins before the last tap, one hop of its noise after the other.
            let lead = late_lead(taps);
            for begun in 0..lead {
                let at = taps - lead + begun;
                energy[at * bands + band] += late_share(at + 1, taps) * late * late_gain(hop.sqrt(), 1.0, begun, taps).powi(2);
            }
            for hop in (0..taps).rev() {
                energy[hop * bands + band] += energy[(hop + 1) * bands + band];
            }
        }
        Self { levels: energy.into_iter().map(|energy| single(energy.ln())).collect(), slopes }
    }

    /// That of responses in one band, from the mean of their energies by sample after the direct sound: a hop is a sample.
    ///
    /// They may end before they are silent: what they lack is an exponential's, as they fall from 5 to 25 dB.
    pub(crate) fn of_samples(energies: &[f64]) -> Self {
        let to_come = |beyond: f64| {
            let sums = energies.iter().rev().scan(beyond, |sum, energy| {
                *sum += energy;
                Some(sum.max(NOTHING).ln())
            });
            let mut levels: Vec<f64> = sums.collect();
            levels.reverse();
            levels
        };
        let cut = to_come(0.0);
        let last = cut.len().saturating_sub(1);
        let falls = |by: f64| cut.iter().position(|level| *level < cut[0] - by).unwrap_or(last);
        let (from, to) = (falls(0.2 * T20_END), falls(T20_END).min(WHOLE_OF_4 * cut.len() / 4));
        let slope = if to > from { (cut[to] - cut[from]) / (to - from) as f64 } else { NOTHING.ln() };
        let end = &energies[energies.len() - energies.len().div_ceil(16)..];
        let middle = end.iter().sum::<f64>() / end.len().max(1) as f64;
        let beyond = middle * (0.5 * slope * end.len() as f64).exp() / (1.0 - slope.exp()).max(NOTHING);
        let levels = to_come(beyond).into_iter().map(single).collect();
        Self { levels, slopes: vec![single(slope)] }
    }

    /// Natural logarithm of the energy that is still to come some hops after the direct sound.
    fn level(&self, band: usize, hops: f64) -> f64 {
        let bands = self.slopes.len();
        let at = |row: usize| f64::from(self.levels[row * bands + band]);
        let (along, last) = ((hops - 1.0).max(0.0), self.levels.len() / bands - 1);
        let row = whole(along);
        if row >= last {
            return at(last) + f64::from(self.slopes[band]) * (along - last as f64);
        }
        at(row) + (along - row as f64) * (at(row + 1) - at(row))
    }

    /// Hops after the direct sound at which less energy than a level is still to come.
    fn falls_below(&self, band: usize, level: f64) -> f64 {
        let (bands, slope) = (self.slopes.len(), f64::from(self.slopes[band]));
        let mut rows = self.levels.chunks_exact(bands).map(|row| f64::from(row[band]));
        match rows.position(|row| row < level) {
            Some(row) => (row + 1) as f64,
            None => {
                (self.levels.len() / bands) as f64 + (self.level(band, (self.levels.len() / bands) as f64) - level) / -slope
            }
        }
    }

    /// What a hop takes of the energy of the late part in a decay so many times as long, natural logarithm: the mean over what
    /// T20 sees of it, for what is now late may have come before the late part.
    pub(crate) fn late_slope(&self, band: usize, times: f64) -> f64 {
        let stated = f64::from(self.slopes[band]) / times;
        let first = (self.levels.len() / self.slopes.len()) as f64;
        let start = self.level(band, first / times);
        let end = times * self.falls_below(band, (self.level(band, 1.0) - T20_END).min(start - LEAST_FALL));
        let slope = (self.level(band, end / times) - start) / (end - first);
        if end > first + 1.0 && slope < 0.0 { slope } else { stated }
    }

    /// Natural logarithm of the gain at some hops after the direct sound that makes a decay so many times as long.
    pub(crate) fn log_gain(&self, band: usize, hops: f64, times: f64) -> f64 {
        0.5 * (self.level(band, hops / times) - self.level(band, hops))
    }

    /// Natural logarithm of the gain at a frequency, interpolated between bands.
    pub(crate) fn log_gain_at(&self, bands: &Bands, hz: f32, hops: f64, times: f64) -> f64 {
        let weights = bands.weights(hz).into_iter();
        weights.map(|(band, weight)| f64::from(weight) * self.log_gain(band, hops, times)).sum()
    }
}

/// What a hop takes of the energy, natural logarithm, by band.
fn slopes(tail: &TailModel, hop_s: f64) -> Vec<f32> {
    tail.t60_s.iter().map(|t60_s| single(-6.0 * std::f64::consts::LN_10 * hop_s / f64::from(*t60_s))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exponential_of_samples_is_made_as_many_times_as_long() {
        // 60 dB in 1000 samples, of which 1100 are known.
        let slope = -6.0 * std::f64::consts::LN_10 / 1000.0;
        let curve = DecayCurve::of_samples(&(0..1100).map(|i| (slope * f64::from(i)).exp()).collect::<Vec<_>>());
        for (after, times) in [(100.0, 0.5), (300.0, 2.0), (800.0, 1.5), (1300.0, 2.0)] {
            let (found, wanted) = (curve.log_gain(0, after, times), 0.5 * slope * after * (1.0 / times - 1.0));
            assert!((found - wanted).abs() < 0.03, "{after} samples, {times} times: {found} for {wanted}");
        }
    }
}
