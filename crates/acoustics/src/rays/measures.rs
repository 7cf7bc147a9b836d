//! What a place sounds like, in numbers, from its images and its echogram.

use crate::images::image::Image;
use crate::materials::air::{Air, speed_m_s};
use crate::octave::{BANDS, Octaves};
use crate::rays::echogram::Echogram;
use glam::DVec3;

/// The octaves of 500 Hz and 1 kHz, over which ISO 3382-1 takes the mean of a room's measures.
const MIDDLE: [usize; 2] = [2, 3];
/// End of what is early, seconds after the first sound.
const EARLY_S: f64 = 0.05;
/// Frequencies of modulation, hertz (IEC 60268-16).
const MODULATION_HZ: [f64; 14] = [0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5];
/// Weight of each octave and of what it shares with the next (IEC 60268-16:2011, male speech).
const WEIGHTS: [f64; BANDS] = [0.085, 0.127, 0.230, 0.233, 0.309, 0.224, 0.173];
const SHARED: [f64; BANDS - 1] = [0.085, 0.078, 0.065, 0.011, 0.047, 0.095];

/// Measures of one place; those that it has none of are `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// Energy of 500 Hz and 1 kHz, mean, dB, where the direct sound at 1 m has 0. None where nothing is heard, and where the
    /// listener is so near to the source that the energy is beyond numbers.
    pub level_db: Option<f64>,
    /// T20, mean of 500 Hz and 1 kHz, seconds (ISO 3382-1).
    pub t20_s: Option<f64>,
    /// C50, mean of 500 Hz and 1 kHz, dB (ISO 3382-1).
    pub c50_db: Option<f64>,
    /// Speech transmission index, 0 to 1 (IEC 60268-16:2011, male speech), of reverberation alone: without noise, masking and
    /// the threshold of hearing, so the best that speech may reach. Modulation after Schroeder, "Modulation transfer
    /// functions", Acustica 49 (1981).
    pub sti: Option<f64>,
}

impl Measures {
    /// Of a listener's images and of the rest of its energy, both of the same source and air.
    #[must_use]
    pub fn new(listener: [f64; 3], images: &[Image], late: &Echogram, air: Option<Air>) -> Self {
        let decay = air.map_or([0.0; BANDS], |air| air.decay_per_m());
        let arrivals: Vec<(f64, Octaves)> = images
            .iter()
            .map(|image| {
                let way = DVec3::from_array(image.position).distance(listener.into());
                let left = |b: usize| f64::from(image.gains[b]).powi(2) / (way * way) * (-f64::from(decay[b]) * way).exp();
                (way / speed_m_s(air), std::array::from_fn(|b| left(b) as f32))
            })
            .collect();
        Self::of_arrivals(&arrivals, late)
    }

    fn of_arrivals(arrivals: &[(f64, Octaves)], late: &Echogram) -> Self {
        let mut whole = late.clone();
        for (time_s, energy) in arrivals {
            whole.add(*time_s, energy, [0.0; 3]);
        }
        let sounding = late.bins.iter().position(|bin| bin.energy.iter().any(|e| *e > 0.0));
        let first = arrivals.iter().map(|a| a.0).fold(f64::INFINITY, f64::min);
        let first = if first.is_finite() { first } else { sounding.map_or(0.0, |i| i as f64 * late.bin_s) };
        let level = middle(|b| Some(whole.energy(b)));
        Self {
            level_db: level.filter(|e| *e > 0.0 && e.is_finite()).map(|e| 10.0 * e.log10()),
            t20_s: middle(|b| whole.t20_s(b)),
            c50_db: middle(|b| c50_db(arrivals, late, first + EARLY_S, b)),
            sti: sti(arrivals, late, first),
        }
    }
}

fn middle(of: impl Fn(usize) -> Option<f64>) -> Option<f64> {
    let [a, b] = MIDDLE.map(of);
    Some(0.5 * (a? + b?))
}

fn c50_db(arrivals: &[(f64, Octaves)], late: &Echogram, end_s: f64, band: usize) -> Option<f64> {
    let mut sums = [0.0; 2];
    for (time_s, energy) in arrivals {
        sums[usize::from(*time_s >= end_s)] += f64::from(energy[band]);
    }
    for (i, bin) in late.bins.iter().enumerate() {
        // A bin that lies on both sides is divided.
        let early = (end_s / late.bin_s - i as f64).clamp(0.0, 1.0);
        let energy = f64::from(bin.energy[band]);
        sums[0] += early * energy;
        sums[1] += (1.0 - early) * energy;
    }
    let [early, late] = sums;
    (early > 0.0 && late > 0.0).then(|| 10.0 * (early / late).log10())
}

fn sti(arrivals: &[(f64, Octaves)], late: &Echogram, first_s: f64) -> Option<f64> {
    let mut transmitted = [0.0; BANDS];
    for (band, transmitted) in transmitted.iter_mut().enumerate() {
        let of_images = arrivals.iter().map(|(t, e)| (t - first_s, f64::from(e[band])));
        let of_bins = late.bins.iter().enumerate();
        let of_bins = of_bins.map(|(i, bin)| ((i as f64 + 0.5) * late.bin_s - first_s, f64::from(bin.energy[band])));
        let all: Vec<(f64, f64)> = of_images.chain(of_bins).filter(|(_, e)| *e > 0.0).collect();
        let sum: f64 = all.iter().map(|a| a.1).sum();
        if sum <= 0.0 {
            return None;
        }
        for hz in MODULATION_HZ {
            let turned = |(t, e): &(f64, f64)| {
                let (sine, cosine) = (std::f64::consts::TAU * hz * t).sin_cos();
                (e * cosine, e * sine)
            };
            let (re, im) = all.iter().map(turned).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
            let kept = (re.hypot(im) / sum).min(1.0);
            let signal_to_noise_db = (10.0 * (kept / (1.0 - kept)).log10()).clamp(-15.0, 15.0);
            *transmitted += (signal_to_noise_db + 15.0) / 30.0 / MODULATION_HZ.len() as f64;
        }
    }
    let own: f64 = WEIGHTS.iter().zip(&transmitted).map(|(w, m)| w * m).sum();
    let shared: f64 = SHARED.iter().zip(transmitted.windows(2)).map(|(w, m)| w * (m[0] * m[1]).sqrt()).sum();
    Some((own - shared).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::echogram::Bin;

    /// A decay of 60 dB in `t60_s`, of energy 1 in every octave.
    fn decaying(t60_s: f64) -> Echogram {
        let (bin_s, rate) = (0.001, 6.0 * std::f64::consts::LN_10 / t60_s);
        let energy = |i: usize| (-(i as f64) * bin_s * rate).exp() * (1.0 - (-bin_s * rate).exp());
        let bins =
            (0..3000).map(|i| Bin { energy: [energy(i) as f32; BANDS], energy_63: energy(i) as f32, from: [[0.0; BANDS]; 3] });
        Echogram { bin_s, bins: bins.collect() }
    }

    #[test]
    fn an_exponential_decay_has_the_measures_of_its_formulas() {
        for t60_s in [0.5, 1.0, 2.0] {
            let found = Measures::of_arrivals(&[], &decaying(t60_s));
            let late = (-0.05 * 6.0 * std::f64::consts::LN_10 / t60_s).exp();
            let c50 = 10.0 * ((1.0 - late) / late).log10();
            // Houtgast and Steeneken's modulation of an exponential decay.
            let kept = |hz: f64| (1.0 + (std::f64::consts::TAU * hz * t60_s / 13.8155).powi(2)).powf(-0.5);
            let index = |m: f64| ((10.0 * (m / (1.0 - m)).log10()).clamp(-15.0, 15.0) + 15.0) / 30.0;
            let sti = MODULATION_HZ.iter().map(|hz| index(kept(*hz))).sum::<f64>() / 14.0;
            assert!((found.level_db.unwrap()).abs() < 0.05, "{found:?}");
            assert!((found.t20_s.unwrap() / t60_s - 1.0).abs() < 0.01, "{found:?}");
            assert!((found.c50_db.unwrap() - c50).abs() < 0.05, "{found:?} for {c50}");
            assert!((found.sti.unwrap() - sti).abs() < 0.005, "{found:?} for {sti}");
        }
    }

    #[test]
    fn a_direct_sound_is_understood_and_silence_has_no_measure() {
        let silent = Echogram { bin_s: 0.01, bins: vec![Bin::default(); 10] };
        let alone = Measures::of_arrivals(&[(0.02, [0.25; BANDS])], &silent);
        assert!((alone.level_db.unwrap() + 6.02).abs() < 0.01 && alone.sti.unwrap() > 0.99, "{alone:?}");
        assert_eq!((alone.t20_s, alone.c50_db), (None, None));
        let none = Measures { level_db: None, t20_s: None, c50_db: None, sti: None };
        assert_eq!(Measures::of_arrivals(&[], &silent), none);
    }
}
