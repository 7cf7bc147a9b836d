//! The decay of a field at low frequencies, as tables of materials mean it.
//!
//! Tables state what walls absorb of sound from everywhere. Axial and tangential modes graze some walls, so that a field of
//! waves decays more slowly than Sabine's or Eyring's. Its modes are kept and their decay is made that of the rays.

use crate::low_frequency::low_field::{FADE, LowField, LowResponse};
use crate::rays::echogram::decay_time_s;
use promenade_fourier::{Fourier, forward, inverse, signal};
use std::f64::consts::{LN_10, PI};
use std::ops::Range;

/// Reverberation times are taken from a decay of so many dB at its end: T20.
const END_DB: f64 = -25.0;
/// Centre of the lowest third, Hz.
const LOWEST_HZ: f64 = 24.0;
/// Length of the frames in which a decay is changed, seconds, at least.
const FRAME_S: f64 = 0.15;
/// A decay that is no exponential is near the wanted one after so many rounds.
const ROUNDS: usize = 3;
/// A decay changes in a round by so many times the wanted one, at most; one that is too fast by a share of it, from here on.
const MOST_TIMES: f64 = 3.0;
const GROWS: f64 = 0.3;
const GROWS_FROM_HZ: f64 = 60.0;
/// Places that are listened to, at most.
const MOST_TOLD: usize = 16;

/// Nepers of amplitude in a second of a reverberation time of a second.
const NEPERS: f64 = 3.0 * LN_10;

impl LowField {
    /// Gives each third octave the reverberation time that is asked for at its centre, Hz and seconds. How it decays is told by
    /// some of the places together. A third without a decay of 25 dB there changes as its neighbour below does.
    pub fn decay_as(&mut self, told: Range<usize>, wanted_s: impl Fn(f64) -> f64) {
        let thirds: Vec<f64> = (-17..)
            .map(|third| 1000.0 * (f64::from(third) / 3.0).exp2())
            .take_while(|hz| *hz < FADE * self.top_hz)
            .filter(|hz| *hz >= LOWEST_HZ)
            .collect();
        let every = told.len().div_ceil(MOST_TOLD).max(1);
        let mut heard: Vec<_> = self.places[told].iter().step_by(every).map(|place| place.pressure.clone()).collect();
        let mut rates = vec![0.0; thirds.len()];
        for _ in 0..ROUNDS {
            let times = third_times_s(&heard, self.rate_hz, &thirds);
            let mut change = 0.0;
            let mut changes = Vec::with_capacity(thirds.len());
            for ((hz, time), rate) in thirds.iter().zip(times).zip(&mut rates) {
                let wanted = NEPERS / wanted_s(*hz);
                change = time.map_or(change, |time| (wanted - NEPERS / time).min(MOST_TIMES * wanted));
                // What is between modes would grow for ever.
                let least = if *hz < GROWS_FROM_HZ { 0.0 } else { -GROWS * wanted };
                let before = *rate;
                *rate = (before + change).max(least);
                changes.push(*rate - before);
            }
            let damping = Damping::new(self.rate_hz, &thirds, &changes);
            heard.iter_mut().for_each(|pressure| damping.apply(pressure));
        }
        let damping = Damping::new(self.rate_hz, &thirds, &rates);
        for LowResponse { pressure, gradient } in &mut self.places {
            [pressure].into_iter().chain(gradient).for_each(|signal| damping.apply(signal));
        }
    }
}

/// T20 by third octave of signals together, seconds.
fn third_times_s(signals: &[Vec<f32>], rate_hz: f64, thirds: &[f64]) -> Vec<Option<f64>> {
    let length = signals.first().map_or(0, Vec::len);
    // As much silence as the narrowest third rings.
    let n = (length + (0.3 * rate_hz) as usize).next_power_of_two();
    let transform = Fourier::new(n);
    let spectra: Vec<_> = signals.iter().map(|signal| transform.spectrum(signal.iter().copied())).collect();
    let of_third = |centre: &f64| {
        let mut energies = vec![0.0; length];
        let share = |k: usize| {
            let thirds = 3.0 * (k.max(1) as f64 * rate_hz / n as f64 / centre).log2();
            (0.5 * PI * thirds.clamp(-1.0, 1.0)).cos() as f32
        };
        let shares: Vec<f32> = (0..=n / 2).map(share).collect();
        for spectrum in &spectra {
            let band = signal(spectrum.iter().zip(&shares).map(|(bin, share)| bin * share).collect(), n);
            energies.iter_mut().zip(band).for_each(|(sum, v): (&mut f64, f32)| *sum += f64::from(v).powi(2));
        }
        decay_time_s(&energies, rate_hz.recip(), END_DB)
    };
    thirds.iter().map(of_third).collect()
}

/// An exponential over time whose rate depends on frequency.
struct Damping {
    rate_hz: f64,
    window: Vec<f32>,
    /// By bin, nepers a second.
    rates: Vec<f64>,
}

impl Damping {
    /// Of rates at the centres of thirds.
    fn new(rate_hz: f64, thirds: &[f64], rates: &[f64]) -> Self {
        let n = ((FRAME_S * rate_hz) as usize).next_power_of_two();
        let at = |hz: f64| {
            let place = thirds.first().map_or(0.0, |first| 3.0 * (hz / first).max(1e-3).log2());
            // Below the first there is hardly any mode, and nothing that should grow.
            if place < 0.0 {
                return rates.first().copied().unwrap_or(0.0).max(0.0);
            }
            let below = (place as usize).min(thirds.len().saturating_sub(1));
            let [low, high] = [below, below + 1].map(|i| rates.get(i).or(rates.last()).copied().unwrap_or(0.0));
            low + (high - low) * (place - below as f64).min(1.0)
        };
        Self {
            rate_hz,
            window: (0..n).map(|i| (PI * (i as f64 + 0.5) / n as f64).sin() as f32).collect(),
            rates: (0..=n / 2).map(|k| at(k as f64 * rate_hz / n as f64)).collect(),
        }
    }

    /// Damps a signal that begins when the source sounds, frame by frame.
    fn apply(&self, samples: &mut [f32]) {
        let (n, hop) = (self.window.len(), self.window.len() / 2);
        let (forward, inverse) = (forward(n), inverse(n));
        let (mut frame, mut bins) = (forward.make_input_vec(), forward.make_output_vec());
        let mut padded = vec![0.0; hop];
        padded.extend_from_slice(samples);
        padded.resize(samples.len().next_multiple_of(hop) + n, 0.0);
        let mut damped = vec![0.0_f32; padded.len()];
        for (number, start) in (0..=padded.len() - n).step_by(hop).enumerate() {
            frame.iter_mut().zip(&padded[start..]).zip(&self.window).for_each(|((out, x), w)| *out = x * w);
            // The lengths come from the plan, and the ends stay real: the only things that the transforms check.
            let there = forward.process(&mut frame, &mut bins);
            let after_s = (number * hop) as f64 / self.rate_hz;
            let gain = |rate: &f64| ((-rate * after_s).exp() / n as f64) as f32;
            bins.iter_mut().zip(&self.rates).for_each(|(bin, rate)| *bin *= gain(rate));
            let back = inverse.process(&mut bins, &mut frame);
            debug_assert!(there.is_ok() && back.is_ok());
            damped[start..].iter_mut().zip(&frame).zip(&self.window).for_each(|((out, x), w)| *out += x * w);
        }
        samples.copy_from_slice(&damped[hop..][..samples.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::random::Random;

    #[test]
    fn thirds_decay_as_they_are_asked_to_and_keep_what_they_are() {
        let (rate_hz, top_hz, length) = (750.0, 300.0, 1500);
        let mut random = Random::new(1);
        let fall = NEPERS / 1.6;
        let mut pressure =
            || -> Vec<f32> { (0..length).map(|i| (-fall * i as f64 / rate_hz).exp() as f32 * random.normal()).collect() };
        let gradient = [(); 3].map(|()| vec![0.0; length]);
        let places = (0..8).map(|_| LowResponse { pressure: pressure(), gradient: gradient.clone() }).collect();
        let before = LowField { rate_hz, top_hz, places };
        // 1.6 s at 25 Hz, .8 s from 100 Hz on.
        let wanted = |hz: f64| 1.6 * (25.0 / hz).clamp(0.25, 1.0).sqrt();
        let mut after = before.clone();
        after.decay_as(0..8, wanted);
        let thirds = [50.0, 63.0, 100.0, 125.0, 160.0, 200.0, 250.0];
        let heard: Vec<Vec<f32>> = after.places.iter().map(|place| place.pressure.clone()).collect();
        for (hz, found) in thirds.iter().zip(third_times_s(&heard, rate_hz, &thirds)) {
            assert!((found.unwrap() / wanted(*hz) - 1.0).abs() < 0.05, "{found:?} at {hz} Hz for {}", wanted(*hz));
        }
        // As long as little has decayed, all is as it was.
        let [old, new] = [&before, &after].map(|field| &field.places[3].pressure[..20]);
        let off: f32 = old.iter().zip(new).map(|(a, b)| (a - b).powi(2)).sum::<f32>() / old.iter().map(|a| a * a).sum::<f32>();
        assert!(off < 0.01, "{off}");
        let mut same = before.clone();
        same.decay_as(0..8, |_| 1.6);
        let off =
            |a: &LowField| a.places.iter().zip(&before.places).map(|(a, b)| a.pressure[700] / b.pressure[700]).sum::<f32>();
        assert!((off(&same) / 8.0 - 1.0).abs() < 0.1, "{}", off(&same));
    }
}
