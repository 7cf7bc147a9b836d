//! What a measured room does after the direct sound: band energies hop by hop, reverberation time, coherence.

use crate::signal::spectrum::{Analyser, at};
use promenade_core::{Bands, StftGrid};

/// Reverberation times outside this range are taken for a failed fit, seconds.
const T60_RANGE_S: std::ops::RangeInclusive<f64> = 0.03..=20.0;
/// Headroom over the noise floor that a hop needs to count, as a ratio of energies (6 dB).
const OVER_NOISE: f64 = 4.0;
/// The fewest hops that a slope is fitted to.
const FEWEST_HOPS: usize = 6;

/// Energy density per hop and band of one ear, `[hop][band]`.
pub(crate) type HopEnergies = Vec<Vec<f64>>;

/// Reverberation time per band, seconds, from energies averaged over many responses: a straight line through the level in dB
/// from hop `from` on, down to where the measurement's noise begins (ISO 3382-1, regression).
pub(crate) fn t60_s(mean: &HopEnergies, from: usize, hop_s: f64) -> Vec<f32> {
    let bands = mean.first().map_or(0, Vec::len);
    let fitted: Vec<Option<f64>> = (0..bands).map(|b| fit_t60(mean, b, from, hop_s)).collect();
    // A band without a decay of its own takes the median of the others.
    let mut known: Vec<f64> = fitted.iter().flatten().copied().collect();
    known.sort_by(f64::total_cmp);
    let typical = known.get(known.len() / 2).copied().unwrap_or(0.3);
    #[expect(clippy::cast_possible_truncation, reason = "seconds")]
    fitted.iter().map(|t| t.unwrap_or(typical) as f32).collect()
}

/// Hops at the start that stand above the measurement's noise in a band.
pub(crate) fn hops_above_noise(mean: &HopEnergies, band: usize) -> usize {
    let tail = mean.len() / 10;
    let floor = mean.iter().rev().take(tail.max(1)).map(|e| e[band]).sum::<f64>() / tail.max(1) as f64;
    mean.iter().position(|e| e[band] < OVER_NOISE * floor || e[band] <= 1e-20).unwrap_or(mean.len())
}

fn fit_t60(mean: &HopEnergies, band: usize, from: usize, hop_s: f64) -> Option<f64> {
    let end = hops_above_noise(mean, band);
    let start = if end >= from + FEWEST_HOPS { from } else { 2.min(end) };
    let points: Vec<(f64, f64)> =
        (start..end).map(|l| (l as f64 * hop_s, 10.0 * mean[l][band].log10())).filter(|p| p.1.is_finite()).collect();
    if points.len() < FEWEST_HOPS {
        return None;
    }
    let n = points.len() as f64;
    let (mt, ml) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = points.iter().map(|p| (p.0 - mt) * (p.1 - ml)).sum();
    let variance: f64 = points.iter().map(|p| (p.0 - mt).powi(2)).sum();
    Some(-60.0 * variance / covariance).filter(|t| T60_RANGE_S.contains(t))
}

/// Gain of an exponential late part at hop `from`, linear amplitude, by least squares on energies from there to the noise.
pub(crate) fn late_gain(energies: &HopEnergies, band: usize, from: usize, until: usize, decay_per_hop: f64) -> f64 {
    let (mut num, mut den) = (0.0, 0.0);
    for (j, e) in energies.iter().take(until).skip(from).enumerate() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a hop count")]
        let model = decay_per_hop.powi(2 * j as i32);
        num += e[band] * model;
        den += model * model;
    }
    if den > 0.0 { (num / den).max(0.0).sqrt() } else { 0.0 }
}

/// Real interaural coherence per band of both ears' sound from sample `start` on.
pub(crate) fn coherence(
    ears: [&[f32]; 2],
    start: i64,
    hops: usize,
    grid: &StftGrid,
    bands: &Bands,
    analyser: &Analyser,
) -> [Vec<f64>; 3] {
    let mut sums = [vec![0.0; bands.count()], vec![0.0; bands.count()], vec![0.0; bands.count()]];
    #[expect(clippy::cast_possible_wrap, reason = "sample counts of a response")]
    for l in 0..hops as i64 {
        let at_hop = start + l * grid.hop as i64;
        let [left, right] = ears.map(|ear| {
            let piece: Vec<f64> = (0..grid.n_fft as i64)
                .map(|i| {
                    let window = (std::f64::consts::PI * i as f64 / grid.n_fft as f64).sin();
                    window * at(ear, at_hop + i)
                })
                .collect();
            analyser.spectrum(&piece)
        });
        for (k, (a, b)) in left.iter().zip(&right).enumerate() {
            #[expect(clippy::cast_possible_truncation, reason = "a frequency in Hz")]
            for (band, w) in bands.weights(grid.bin_hz(k) as f32) {
                let w = f64::from(w);
                sums[0][band] += w * (a * b.conj()).re;
                sums[1][band] += w * a.norm_sqr();
                sums[2][band] += w * b.norm_sqr();
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_slope_of_an_exponential_above_its_noise() {
        let energies: HopEnergies =
            (0..150).map(|l| vec![10.0_f64.powf(-6.0 * f64::from(l) * 0.005 / 0.5) + 1e-7, 1e-30]).collect();
        let t = t60_s(&energies, 8, 0.005);
        assert!((t[0] - 0.5).abs() < 0.02, "{t:?}");
        assert_eq!(t[0], t[1], "a silent band takes the typical value");
        let decay = 10.0_f64.powf(-3.0 * 0.005 / 0.5);
        assert!((late_gain(&energies, 0, 10, 60, decay) - decay.powi(10)).abs() < 1e-3);
    }
}
