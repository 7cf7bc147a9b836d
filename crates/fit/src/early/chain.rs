//! What loudspeaker and microphone do to a direct sound, from the direct sounds of all measurements.

use crate::measurements::{Clock, Measurement, Measurements};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{signal, spectrum};
use promenade_metrics::onset;

/// Before and after the direct sound's first sample, seconds; the last part fades.
const WINDOW_S: (f64, f64, f64) = (0.001, 0.004, 0.0015);
/// Direct sounds are searched this far about the first loud sample, seconds.
const SEARCH_S: f64 = 0.001;
/// Points between samples where a direct sound may lie.
const FINE: usize = 8;

/// The chain's response and when direct sounds came.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Its response at 1 m on the axis, sample by sample.
    pub response: Vec<f64>,
    /// The sample of it that belongs to the arrival.
    pub lead: usize,
    /// When each measurement's direct sound arrived, seconds from its first sample.
    pub arrivals_s: Vec<f64>,
    /// Seconds from a way's length over the speed of sound to the arrival, if clocks are known.
    pub delay_s: f64,
    /// Whether they are.
    pub known: bool,
    /// The speed of sound, metres per second.
    pub speed_m_s: f64,
}

impl Chain {
    /// Aligns direct sounds and takes their mean, each by its distance; `None` of no measurements.
    #[must_use]
    pub fn of(set: &Measurements) -> Option<Self> {
        let rate = f64::from(set.sample_rate_hz);
        let samples = |s: f64| (s * rate).round() as usize;
        let (before, after, fade) = (samples(WINDOW_S.0), samples(WINDOW_S.1), samples(WINDOW_S.2));
        let starts: Vec<usize> = set.all.iter().map(|m| onset(&m.samples).unwrap_or(0)).collect();
        let length = (before + after + 2 * samples(SEARCH_S)).next_power_of_two();
        // The response's window moved so that its arrival is at `before`, whole samples.
        let cut = |m: &Measurement, from: isize| -> Vec<f64> {
            let at = |i: usize| from.checked_add_unsigned(i).and_then(|i| usize::try_from(i).ok());
            (0..before + after)
                .map(|i| {
                    let weight = if i + fade < before + after { 1.0 } else { (before + after - i) as f64 / fade as f64 };
                    let rise = if i < before { (i as f64 / before as f64).powi(2) } else { 1.0 };
                    weight * rise * at(i).and_then(|i| m.samples.get(i)).map_or(0.0, |v| f64::from(*v))
                })
                .collect()
        };
        let windows: Vec<Vec<f64>> =
            set.all.iter().zip(&starts).map(|(m, s)| cut(m, s.cast_signed() - before.cast_signed())).collect();
        let spectra: Vec<Vec<Complex64>> = windows.iter().map(|w| spectrum(w.iter().copied(), length)).collect();
        let nearest = (0..set.all.len()).min_by(|a, b| set.all[*a].distance_m().total_cmp(&set.all[*b].distance_m()))?;
        let mut reference = spectra[nearest].clone();
        let mut shifts = vec![0.0; spectra.len()];
        // The mean is a better reference than any one of them.
        for _ in 0..2 {
            for (shift, own) in shifts.iter_mut().zip(&spectra) {
                *shift = lag(own, &reference, length, SEARCH_S * rate);
            }
            reference = vec![Complex64::default(); length / 2 + 1];
            for ((m, own), shift) in set.all.iter().zip(&spectra).zip(&shifts) {
                let weight = m.distance_m() / set.all.len() as f64;
                for (k, (r, bin)) in reference.iter_mut().zip(own).enumerate() {
                    let turn = std::f64::consts::TAU * k as f64 * shift / length as f64;
                    *r += bin * Complex64::from_polar(weight, turn);
                }
            }
        }
        let response: Vec<f64> = signal(reference, length).into_iter().take(before + after).collect();
        let arrivals_s: Vec<f64> = starts.iter().zip(&shifts).map(|(s, d)| (*s as f64 + d) / rate).collect();
        let known = set.all.iter().all(|m| m.clock == Clock::Known);
        let speed_m_s = set.air.speed_m_s();
        let delays = set.all.iter().zip(&arrivals_s).map(|(m, t)| if known { t - m.distance_m() / speed_m_s } else { *t });
        let delay_s = delays.sum::<f64>() / set.all.len() as f64;
        Some(Self { response, lead: before, arrivals_s, delay_s, known, speed_m_s })
    }

    /// When the direct sound of a place elsewhere arrives, seconds from the first sample.
    #[must_use]
    pub fn arrival_s(&self, distance_m: f64) -> f64 {
        if self.known { self.delay_s + distance_m / self.speed_m_s } else { self.delay_s }
    }
}

/// By how many samples a signal lies later than another, from their spectra.
fn lag(own: &[Complex64], reference: &[Complex64], length: usize, most: f64) -> f64 {
    let mut product: Vec<Complex64> = own.iter().zip(reference).map(|(a, b)| a * b.conj()).collect();
    product.resize(length * FINE / 2 + 1, Complex64::default());
    let correlation = signal(product, length * FINE);
    let most = ((most * FINE as f64) as usize).min(length * FINE / 2 - 1);
    let at = |i: isize| correlation[i.rem_euclid((length * FINE).cast_signed()).cast_unsigned()];
    let range = -most.cast_signed()..=most.cast_signed();
    let best = range.max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap_or(0);
    best as f64 / FINE as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurements::Place;
    use promenade_acoustics::Air;

    #[test]
    fn direct_sounds_between_samples_are_aligned_in_any_weather() {
        for temperature_c in [20.0, -10.0, 45.0] {
            aligned(Air { temperature_c, ..Air::default() });
        }
    }

    fn aligned(air: Air) {
        let speed = air.speed_m_s();
        let rate = 16_000.0;
        let place = |x: f64| Place { at_m: [x, 0.0, 0.0], sd_m: 0.0, facing: None };
        let one = |distance: f64| {
            let arrival = (0.005 + distance / speed) * rate;
            // A band-limited click, weaker with distance.
            let samples = (0..800).map(|i| {
                let x = f64::from(i) - arrival;
                let sinc = if x.abs() < 1e-9 {
                    1.0
                } else {
                    (0.5 * std::f64::consts::PI * x).sin() / (0.5 * std::f64::consts::PI * x)
                };
                (sinc * (-(x / 6.0).powi(2)).exp() / distance) as f32
            });
            Measurement {
                name: String::new(),
                source: place(0.0),
                microphone: place(distance),
                clock: Clock::Known,
                samples: samples.collect(),
            }
        };
        let all = [1.0, 1.37, 2.222, 3.1].map(one).to_vec();
        let set = Measurements { title: String::new(), sample_rate_hz: 16_000, all, notes: Vec::new(), air };
        let chain = Chain::of(&set).unwrap();
        for (m, t) in set.all.iter().zip(&chain.arrivals_s) {
            let meant = chain.delay_s + m.distance_m() / speed;
            assert!((t - meant).abs() < 1e-5, "{t} {meant}");
        }
        assert!((chain.delay_s - 0.005).abs() < 1e-3, "{}", chain.delay_s);
        let peak = chain.response.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!((peak - 1.0).abs() < 0.1, "{peak}");
    }
}
