//! Noise with the energy of diffuse sound.

use crate::bands::{energy, octaves_at, share};
use crate::numerics::Random;
use promenade_fourier::{signal, spectrum};

/// A draw of noise in octaves, each of a mean power of 1, coloured within them as a chain colours it.
#[derive(Clone, Debug)]
pub(crate) struct Noise {
    octaves: Vec<Vec<f32>>,
}

impl Noise {
    /// Draws `length` samples.
    #[must_use]
    pub(crate) fn new(chain: &[f64], length: usize, sample_rate_hz: f64, seed: u64) -> Self {
        let transform = (length + chain.len()).next_power_of_two();
        let colour = spectrum(chain.iter().copied(), transform);
        let mut octaves = Vec::with_capacity(octaves_at(sample_rate_hz));
        for number in 0..octaves_at(sample_rate_hz) {
            // Each has noise of its own: where two overlap, one noise would add up in step.
            let mut random = Random::new(seed, 0x7461_696C + number as u64);
            let mut bins = spectrum((0..length).map(|_| random.normal()), transform);
            bins.iter_mut().zip(&colour).enumerate().for_each(|(k, (b, c))| {
                *b *= c * share(number, k as f64 * sample_rate_hz / transform as f64, sample_rate_hz);
            });
            let mut octave: Vec<f32> = signal(bins, transform).into_iter().take(length).map(|v| v as f32).collect();
            let power = energy(&octave) / length as f64;
            let gain = power.max(1e-30).sqrt().recip() as f32;
            octave.iter_mut().for_each(|v| *v *= gain);
            octaves.push(octave);
        }
        Self { octaves }
    }

    /// Adds octave `number` to a signal from a sample on, with energies by bin of so many samples.
    pub(crate) fn add(&self, number: usize, to: &mut [f32], from: usize, energies: &[f64], bin: f64) {
        let amplitude = |i: usize| (energies.get(i).copied().unwrap_or(0.0) / bin).sqrt();
        let noise = self.octaves[number].get(from..).unwrap_or_default();
        for (i, (slot, v)) in to.iter_mut().skip(from).zip(noise).enumerate() {
            // Straight lines between the middles of bins.
            let at = (i as f64 / bin - 0.5).max(0.0);
            let (below, fraction) = (at as usize, at.fract());
            if below > energies.len() {
                break;
            }
            let gain = amplitude(below) * (1.0 - fraction) + amplitude(below + 1) * fraction;
            *slot += gain as f32 * v;
        }
    }
}
