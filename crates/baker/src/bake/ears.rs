//! What a head in third-order Ambisonics hears of a place.

use promenade_core::glam::Vec3;
use promenade_core::head::harmonics;
use promenade_core::{AMBISONIC_CHANNELS, AmbisonicHead};
use promenade_fourier::Fourier;
use promenade_fourier::num_complex::Complex64;
use std::f64::consts::TAU;

/// What a head hears of places, as spectra.
pub(crate) struct Ears {
    pub(crate) rate: f64,
    pub(crate) n_fft: usize,
    pub(crate) fourier: Fourier<f64>,
    /// Of each filter of the head.
    filters: Vec<Vec<Complex64>>,
    /// Samples of the head before the sound is at its centre.
    lead: f64,
}

impl Ears {
    /// For signals of `len` samples.
    pub(crate) fn new(head: &AmbisonicHead, len: usize) -> Self {
        let (rate, n_fft) = (head.sample_rate_hz, (len + head.len()).next_power_of_two());
        let fourier = Fourier::<f64>::new(n_fft);
        let spectrum = |filter: &[f32]| fourier.spectrum(filter.iter().map(|v| f64::from(*v)));
        Self {
            rate,
            n_fft,
            filters: head.filters.chunks_exact(head.len()).map(spectrum).collect(),
            lead: head.lead as f64,
            fourier,
        }
    }

    pub(crate) fn hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate / self.n_fft as f64
    }

    /// What an ear hears of a place, seen from the head, whose sound is at the head's centre after so many samples.
    pub(crate) fn of_place(&self, way: Vec3, samples: f64, ear: usize) -> Vec<Complex64> {
        let distance = way.length().max(1e-3);
        let shares = harmonics(AMBISONIC_CHANNELS.isqrt() - 1, way / distance);
        let delay = samples - self.lead;
        let turned = |k: usize| {
            let sum: Complex64 = (0..AMBISONIC_CHANNELS).map(|c| self.filters[2 * c + ear][k] * f64::from(shares[c])).sum();
            sum * Complex64::from_polar(1.0 / f64::from(distance), -TAU * k as f64 * delay / self.n_fft as f64)
        };
        (0..self.n_fft / 2 + 1).map(turned).collect()
    }
}
