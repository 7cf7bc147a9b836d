//! What comes after the images: noise with a given energy over time.

use super::hrtf::Hrtf;
use promenade_acoustics::{BANDS, Bin, centred, octave_energy_from_63};
use promenade_core::random::Random;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use std::sync::Arc;

/// Length of the frames in which noise is shaped, seconds, about.
const FRAME_S: f64 = 0.008;

/// Energy a sample by octave and at 63 Hz, about each hop of half a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Variance {
    octaves: [f64; BANDS],
    low: f64,
}

impl Variance {
    /// Adds what a bin brings to a hop of so many samples.
    pub(super) fn add(&mut self, bin: &Bin, hop: usize) {
        self.octaves.iter_mut().zip(bin.energy).for_each(|(sum, energy)| *sum += f64::from(energy) / hop as f64);
        self.low += f64::from(bin.energy_63) / hop as f64;
    }
}

/// Noise at both ears with the diffuse field's coherence between them.
pub(super) struct Tail {
    n_fft: usize,
    length: usize,
    seed: u64,
    sample_rate_hz: f64,
    /// Shares of the common and of the opposite noise, by bin.
    shares: Vec<[f32; 2]>,
    window: Vec<f32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Tail {
    /// For responses of `length` samples.
    pub(super) fn new(hrtf: &Hrtf, length: usize, seed: u64) -> Self {
        let rate = hrtf.bins.sample_rate_hz;
        let n_fft = ((FRAME_S * rate) as usize).next_power_of_two();
        let shares = |k: usize| {
            let coherence = hrtf.coherence(k as f64 * rate / n_fft as f64);
            [(0.5 * (1.0 + coherence)).sqrt(), (0.5 * (1.0 - coherence)).sqrt()]
        };
        Self {
            n_fft,
            length,
            seed,
            sample_rate_hz: rate,
            shares: (0..=n_fft / 2).map(shares).collect(),
            window: (0..n_fft).map(|i| (std::f32::consts::PI * (i as f32 + 0.5) / n_fft as f32).sin()).collect(),
            forward: promenade_fourier::forward(n_fft),
            inverse: promenade_fourier::inverse(n_fft),
        }
    }

    /// Samples from one hop to the next; hop `l` lies about sample `l * hop`.
    pub(super) fn hop(&self) -> usize {
        self.n_fft / 2
    }

    /// Hops that reach into the responses.
    pub(super) fn hops(&self) -> usize {
        self.length.div_ceil(self.hop()) + 2
    }

    /// Bins of a hop.
    pub(super) fn bins(&self) -> usize {
        self.n_fft / 2 + 1
    }

    /// Standard deviation of the noise by bin.
    pub(super) fn gains(&self, variance: &Variance) -> Vec<f32> {
        let hz = |k: usize| k as f64 * self.sample_rate_hz / self.n_fft as f64;
        let (low, octaves) = centred(variance.low, &variance.octaves);
        (0..self.bins()).map(|k| octave_energy_from_63(low, &octaves, hz(k)).sqrt() as f32).collect()
    }

    /// Adds the tail of pose number `index`, whose noise is its own: of each hop from `first` on the standard deviation by bin
    /// at each ear.
    pub(super) fn add<'g>(
        &self,
        index: u64,
        first: usize,
        mut gains: impl FnMut(usize) -> [&'g [f32]; 2],
        ears: &mut [Vec<f32>; 2],
    ) {
        let hop = self.hop();
        let mut random = Random::new(self.seed ^ (index + 1).wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut noise = || (0..self.length + 2 * self.n_fft).map(|_| random.normal()).collect::<Vec<f32>>();
        let noises = [noise(), noise()];
        let (mut time, mut spectra) =
            (self.forward.make_input_vec(), [self.forward.make_output_vec(), self.forward.make_output_vec()]);
        let mut ear_spectrum = self.inverse.make_input_vec();
        for l in first..self.hops() {
            for (noise, spectrum) in noises.iter().zip(&mut spectra) {
                for ((t, n), w) in time.iter_mut().zip(&noise[l * hop..]).zip(&self.window) {
                    *t = n * w;
                }
                let done = self.forward.process(&mut time, spectrum);
                debug_assert!(done.is_ok());
            }
            for ((out, sign), gains) in ears.iter_mut().zip([1.0, -1.0]).zip(gains(l)) {
                for (k, e) in ear_spectrum.iter_mut().enumerate() {
                    let [common, opposite] = self.shares[k];
                    *e = (spectra[0][k] * common + spectra[1][k] * (sign * opposite)) * (gains[k] / self.n_fft as f32);
                }
                ends_real(&mut ear_spectrum);
                let done = self.inverse.process(&mut ear_spectrum, &mut time);
                debug_assert!(done.is_ok());
                let start = (l * hop).checked_sub(hop);
                let skip = if start.is_none() { hop } else { 0 };
                let shaped = time.iter().zip(&self.window).skip(skip).map(|(t, w)| t * w);
                for (o, v) in out.iter_mut().skip(start.unwrap_or(0)).zip(shaped) {
                    *o += v;
                }
            }
        }
    }
}

/// The ends of a real signal's spectrum are real.
pub(super) fn ends_real(spectrum: &mut [Complex32]) {
    if let [first, .., last] = spectrum {
        (first.im, last.im) = (0.0, 0.0);
    }
}
