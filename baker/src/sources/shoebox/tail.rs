//! What comes after the images: noise that decays as the room's energy does.

use super::walls::{energy, octave_place};
use super::{BoxOptions, BoxRoom, Hrtf, SPEED_OF_SOUND_M_S, position};
use crate::signal::random::Random;
use promenade_acoustics::{BoxImage, box_images};
use promenade_core::glam::Vec3;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use std::sync::Arc;

/// Length of the frames in which noise is shaped, seconds, about.
const FRAME_S: f64 = 0.008;
/// Places in the room that the images' mean energy is taken over.
const PLACES: usize = 400;

/// Noise at both ears with the diffuse field's coherence between them. Its energy is what the images leave of the statistical energy
/// of the room: `4 pi c / V` a second where the direct sound at 1 m has 1, decaying after Eyring.
pub(super) struct Tail {
    n_fft: usize,
    length: usize,
    seed: u64,
    emitter: Vec3,
    size: Vec3,
    sample_rate_hz: f64,
    /// Images that are left out first.
    next: Vec<BoxImage>,
    /// Standard deviation of the noise, `[hop][bin]`, hops of half a frame.
    gains: Vec<Vec<f32>>,
    /// Shares of the common and of the opposite noise, by bin.
    shares: Vec<[f32; 2]>,
    window: Vec<f32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Tail {
    pub(super) fn new(
        room: &BoxRoom,
        emitter: Vec3,
        early: &[BoxImage],
        hrtf: &Hrtf,
        options: &BoxOptions,
        length: usize,
    ) -> Self {
        let rate = f64::from(options.sample_rate_hz);
        let n_fft = ((FRAME_S * rate) as usize).next_power_of_two();
        let hop = n_fft / 2;
        let hops = length.div_ceil(hop) + 2;
        let variances = variances(room, emitter, early, hops, hop, rate);
        let hz = |k: usize| k as f64 * rate / n_fft as f64;
        let bins = n_fft / 2 + 1;
        let gain = |energies: &[f64; 7], k: usize| {
            let (below, fraction) = octave_place(hz(k));
            let [a, b] = [energies[below], energies[below + 1]];
            // Levels lie between those of the octaves.
            let energy = if a > 0.0 && b > 0.0 { a * (b / a).powf(fraction) } else { a + fraction * (b - a) };
            energy.sqrt() as f32
        };
        let shares = |k: usize| {
            let coherence = hrtf.coherence(hz(k));
            [(0.5 * (1.0 + coherence)).sqrt(), (0.5 * (1.0 - coherence)).sqrt()]
        };
        let order = options.order + 1;
        Self {
            n_fft,
            length,
            seed: options.seed,
            emitter,
            size: room.size,
            sample_rate_hz: rate,
            next: box_images(order).into_iter().filter(|i| i.order() == order).collect(),
            gains: variances.iter().map(|v| (0..bins).map(|k| gain(v, k)).collect()).collect(),
            shares: (0..bins).map(shares).collect(),
            window: (0..n_fft).map(|i| (std::f32::consts::PI * (i as f32 + 0.5) / n_fft as f32).sin()).collect(),
            forward: promenade_fourier::forward(n_fft),
            inverse: promenade_fourier::inverse(n_fft),
        }
    }

    /// Adds the tail of pose number `index`, whose noise is its own.
    pub(super) fn add(&self, listener: Vec3, index: u64, ears: &mut [Vec<f32>; 2]) {
        let hop = self.n_fft / 2;
        let first =
            self.next.iter().map(|i| position(i, self.emitter, self.size).distance(listener)).fold(f32::INFINITY, f32::min);
        let first_sample = f64::from(first / SPEED_OF_SOUND_M_S) * self.sample_rate_hz;
        let mut random = Random::new(self.seed ^ (index + 1).wrapping_mul(0xD6E8_FEB8_6659_FD93));
        let mut noise = || (0..self.length + 2 * self.n_fft).map(|_| random.normal()).collect::<Vec<f32>>();
        let noises = [noise(), noise()];
        let (mut time, mut spectra) =
            (self.forward.make_input_vec(), [self.forward.make_output_vec(), self.forward.make_output_vec()]);
        let mut ear_spectrum = self.inverse.make_input_vec();
        // Frame l lies about sample l * hop.
        for (l, gains) in self.gains.iter().enumerate() {
            // What begins before the first image that is left out would be heard among those that are not.
            if (l as f64 - 1.0) * hop as f64 <= first_sample {
                continue;
            }
            for (noise, spectrum) in noises.iter().zip(&mut spectra) {
                for ((t, n), w) in time.iter_mut().zip(&noise[l * hop..]).zip(&self.window) {
                    *t = n * w;
                }
                let done = self.forward.process(&mut time, spectrum);
                debug_assert!(done.is_ok());
            }
            for (out, sign) in ears.iter_mut().zip([1.0, -1.0]) {
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

/// Energy a sample by hop and octave that the images do not have.
fn variances(room: &BoxRoom, emitter: Vec3, early: &[BoxImage], hops: usize, hop: usize, rate: f64) -> Vec<[f64; 7]> {
    let mut random = Random::new(0);
    let mut had = vec![[0.0_f64; 7]; hops];
    let energies: Vec<[f64; 7]> = early.iter().map(|i| std::array::from_fn(|octave| energy(room, i, octave))).collect();
    for _ in 0..PLACES {
        let place = room.size * Vec3::new(random.uniform(), random.uniform(), random.uniform());
        for (image, energy) in early.iter().zip(&energies) {
            let distance = f64::from(position(image, emitter, room.size).distance(place));
            let at = distance / f64::from(SPEED_OF_SOUND_M_S) * rate / hop as f64;
            let Some(had) = had.get_mut(at.round() as usize) else { continue };
            for (h, e) in had.iter_mut().zip(energy) {
                *h += e / distance.powi(2).max(0.01) / (PLACES * hop) as f64;
            }
        }
    }
    let decay = room.decay_per_s().map(f64::from);
    let density = 4.0 * std::f64::consts::PI * f64::from(SPEED_OF_SOUND_M_S) / f64::from(room.volume_m3()) / rate;
    had.iter()
        .enumerate()
        .map(|(l, had)| {
            std::array::from_fn(|octave: usize| {
                let t = (l * hop) as f64 / rate;
                (density * (-decay[octave] * t).exp() - had[octave]).max(0.0)
            })
        })
        .collect()
}
