//! How far a signal and the noise about it are from what was observed, over time and frequency, and what makes it less.
//!
//! The mean difference of logarithms of magnitudes over short-time transforms of several lengths (Yamamoto et al. 2020), with
//! its derivative by each sample. Scattered sound is known by its power alone: it is added to the signal's power, with the
//! factor that makes the median of the noise's own power that of the model.

use crate::bands::{BANDS, Bands};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{ComplexToReal, RealToComplex, forward, inverse};
use std::f64::consts::{LN_2, TAU};
use std::sync::Arc;

/// Lengths of the transforms, samples.
const LENGTHS: [usize; 4] = [64, 128, 256, 512];
/// Power below the loudest bin that counts as none.
const FLOOR: f64 = 1e-6;
/// Samples of a piece of the noise's power.
pub(crate) const PIECE: usize = 32;

struct Window {
    hann: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// Bins that count, from the first to before the last.
    bins: (usize, usize),
}

/// The measure for signals of one rate, in a range of frequencies.
pub(crate) struct Loss {
    windows: Vec<Window>,
    rate_hz: f64,
}

/// Amplitude of errors of the model over what was observed, where waves are compared.
const MODEL: f64 = 0.12;
/// Power over that of the noise from which on waves tell whether they agree, and samples of the direct sound, which always do.
const CLEAR: f64 = 4.0;
const DIRECT: usize = 96;

/// What a signal is compared with.
pub(crate) struct Target {
    logs: Vec<Vec<f64>>,
    /// Its bins themselves.
    bins: Vec<Vec<Complex64>>,
    floor: f64,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compared {
    /// Logarithms of magnitudes, which hold where times are known to less than a wave.
    Magnitudes,
    /// Bins as complex numbers: the likelihood of a Gaussian whose variance is the noise's power and the model's own error.
    /// Tells more where noise is as strong as what is known, if times are known well enough.
    Waves,
}

/// A number by window, frame and bin: the noise's power, or what grows with it.
pub(crate) struct Noise(Vec<Vec<f64>>);

/// Power by sample of what is known by its power, in pieces of [`PIECE`] samples, by band, where the chain's is 1.
pub(crate) type Power = Vec<[f64; BANDS]>;

impl Loss {
    pub(crate) fn new(rate_hz: f64, range_hz: (f64, f64)) -> Self {
        let window = |length: usize| {
            let bin = |hz: f64| hz / rate_hz * length as f64;
            let last = (bin(range_hz.1) as usize + 1).min(length / 2 + 1);
            Window {
                hann: (0..length).map(|i| 0.5 - 0.5 * (TAU * i as f64 / length as f64).cos()).collect(),
                forward: forward(length),
                inverse: inverse(length),
                bins: ((bin(range_hz.0).ceil() as usize).min(last - 1), last),
            }
        };
        Self { windows: LENGTHS.into_iter().map(window).collect(), rate_hz }
    }

    /// Calls for each frame of a window with its first sample and spectrum.
    fn frames(window: &Window, x: &[f64], mut with: impl FnMut(usize, &[Complex64])) {
        let length = window.hann.len();
        let (mut time, mut bins) = (window.forward.make_input_vec(), window.forward.make_output_vec());
        for from in (0..(x.len() + 1).saturating_sub(length)).step_by(length / 4) {
            for ((t, v), w) in time.iter_mut().zip(&x[from..]).zip(&window.hann) {
                *t = v * w;
            }
            let done = window.forward.process(&mut time, &mut bins);
            debug_assert!(done.is_ok());
            with(from, &bins[window.bins.0..window.bins.1]);
        }
    }

    /// What signals are to be compared with.
    pub(crate) fn target(&self, x: &[f64]) -> Target {
        let mut most = 0.0_f64;
        for window in &self.windows {
            Self::frames(window, x, |_, bins| most = bins.iter().fold(most, |m, b| m.max(b.norm_sqr())));
        }
        let floor = FLOOR * most.max(1e-30);
        let bins: Vec<Vec<Complex64>> = self
            .windows
            .iter()
            .map(|window| {
                let mut all = Vec::new();
                Self::frames(window, x, |_, bins| all.extend_from_slice(bins));
                all
            })
            .collect();
        let logs = bins.iter().map(|w| w.iter().map(|b| 0.5 * (b.norm_sqr() + floor).ln()).collect()).collect();
        Target { logs, bins, floor }
    }

    /// Shares of bands in a bin, and the chain's power there: bands below, share of the next, power.
    fn bins_of(&self, window: &Window, bands: &Bands, chain: &[f64]) -> Vec<(usize, f64, f64)> {
        let length = window.hann.len();
        (window.bins.0..window.bins.1)
            .map(|k| {
                let (below, fraction) = bands.place(k as f64 * self.rate_hz / length as f64);
                let place = k as f64 / (length / 2) as f64 * (chain.len() - 1) as f64;
                (below, fraction, LN_2 * chain[(place.round() as usize).min(chain.len() - 1)])
            })
            .collect()
    }

    /// Weights of the pieces in a frame: the square of the window over each.
    fn pieces(window: &Window, from: usize) -> Vec<(usize, f64)> {
        let mut pieces: Vec<(usize, f64)> = Vec::with_capacity(window.hann.len() / PIECE + 2);
        for (i, w) in window.hann.iter().enumerate() {
            let piece = (from + i) / PIECE;
            match pieces.last_mut() {
                Some((p, sum)) if *p == piece => *sum += w * w,
                _ => pieces.push((piece, w * w)),
            }
        }
        pieces
    }

    /// Puts noise of a power beside the signal, coloured by a chain whose power by frequency is given in even steps from 0 to
    /// half the sample rate.
    pub(crate) fn noise(&self, power: &Power, bands: &Bands, chain: &[f64], frames: &Target) -> Noise {
        let of = |(window, logs): (&Window, &Vec<f64>)| {
            let bins = self.bins_of(window, bands, chain);
            let mut noise = vec![0.0; logs.len()];
            for (frame, own) in noise.chunks_mut(bins.len()).enumerate() {
                let mut sum = [0.0; BANDS];
                for (piece, weight) in Self::pieces(window, frame * window.hann.len() / 4) {
                    if let Some(piece) = power.get(piece) {
                        sum.iter_mut().zip(piece).for_each(|(s, p)| *s += weight * p);
                    }
                }
                for (slot, (below, fraction, chain)) in own.iter_mut().zip(&bins) {
                    *slot = chain * (sum[*below] * (1.0 - fraction) + sum[below + 1] * fraction);
                }
            }
            noise
        };
        Noise(self.windows.iter().zip(&frames.logs).map(of).collect())
    }

    /// Derivatives by the noise's power of a number whose derivatives by noise in frames and bins are given.
    pub(crate) fn by_power(&self, by_noise: &Noise, pieces: usize, bands: &Bands, chain: &[f64]) -> Power {
        let mut by = vec![[0.0; BANDS]; pieces];
        for (window, noise) in self.windows.iter().zip(&by_noise.0) {
            let bins = self.bins_of(window, bands, chain);
            for (frame, own) in noise.chunks(bins.len()).enumerate() {
                let mut sum = [0.0; BANDS];
                for (slot, (below, fraction, chain)) in own.iter().zip(&bins) {
                    sum[*below] += slot * chain * (1.0 - fraction);
                    sum[below + 1] += slot * chain * fraction;
                }
                for (piece, weight) in Self::pieces(window, frame * window.hann.len() / 4) {
                    if let Some(piece) = by.get_mut(piece) {
                        piece.iter_mut().zip(&sum).for_each(|(p, s)| *p += weight * s);
                    }
                }
            }
        }
        by
    }

    /// The measure, and its derivatives by each sample and by the noise.
    pub(crate) fn of(&self, what: Compared, x: &[f64], noise: &Noise, target: &Target) -> (f64, Vec<f64>, Noise) {
        match what {
            Compared::Magnitudes => self.sum(x, noise, target, |bin, noise, log, _| {
                let power = bin.norm_sqr() + noise + target.floor;
                let off = 0.5 * power.ln() - log;
                (off.abs(), bin * (off.signum() / power), 0.5 * off.signum() / power)
            }),
            Compared::Waves => self.sum(x, noise, target, |bin, noise, _, observed| {
                let variance = Self::variance(noise, observed, target);
                let (off, power) = (bin - observed, (bin - observed).norm_sqr());
                let by_noise = (1.0 - power / variance) / variance / LN_2;
                (power / variance + variance.ln(), off * (2.0 / variance), by_noise)
            }),
        }
    }

    /// Expected power of the distance between waves. The noise is given by its median.
    fn variance(noise: f64, observed: Complex64, target: &Target) -> f64 {
        noise / LN_2 + MODEL * MODEL * observed.norm_sqr() + target.floor
    }

    /// The mean over windows and bins of a measure that is told a bin, its noise, and the logarithm and the bin that were
    /// observed, and tells its value, its derivative by the bin and by the noise.
    fn sum(
        &self,
        x: &[f64],
        noise: &Noise,
        target: &Target,
        of: impl Fn(Complex64, f64, f64, Complex64) -> (f64, Complex64, f64),
    ) -> (f64, Vec<f64>, Noise) {
        let (mut sum, mut by) = (0.0, vec![0.0; x.len()]);
        let mut by_noise = Vec::with_capacity(self.windows.len());
        for (w, window) in self.windows.iter().enumerate() {
            let (logs, observed, noise) = (&target.logs[w], &target.bins[w], &noise.0[w]);
            let mut by_own = Vec::with_capacity(noise.len());
            let scale = 1.0 / (logs.len().max(1) * self.windows.len()) as f64;
            let first = window.bins.0;
            let mut at = 0;
            let mut back = window.inverse.make_input_vec();
            let mut time = window.inverse.make_output_vec();
            let half = window.hann.len() / 2;
            Self::frames(window, x, |from, bins| {
                back.fill(Complex64::default());
                for (k, bin) in bins.iter().enumerate() {
                    let (value, by_bin, grown) = of(*bin, noise[at], logs[at], observed[at]);
                    sum += scale * value;
                    by_own.push(scale * grown);
                    // The transform back counts every bin but the ends twice.
                    let k = first + k;
                    let ends = if k == 0 || k == half { 1.0 } else { 0.5 };
                    back[k] = by_bin * (scale * ends);
                    at += 1;
                }
                back[0].im = 0.0;
                back[half].im = 0.0;
                let done = window.inverse.process(&mut back, &mut time);
                debug_assert!(done.is_ok());
                for ((slot, v), w) in by[from..].iter_mut().zip(&time).zip(&window.hann) {
                    *slot += v * w;
                }
            });
            by_noise.push(by_own);
        }
        (sum, by, Noise(by_noise))
    }

    /// Squares of distances between waves over what they are expected to be, where reflections are clear of noise, and how many
    /// they are: about 1 each if times are right.
    pub(crate) fn agreement(&self, x: &[f64], noise: &Noise, target: &Target) -> (f64, f64) {
        let (mut sum, mut count) = (0.0, 0.0);
        for (w, window) in self.windows.iter().enumerate() {
            let mut at = target.bins[w].iter().zip(&noise.0[w]);
            Self::frames(window, x, |from, bins| {
                for (bin, (observed, noise)) in bins.iter().zip(&mut at) {
                    if from >= DIRECT && bin.norm_sqr() > CLEAR * noise / LN_2 + target.floor {
                        sum += (bin - observed).norm_sqr() / Self::variance(*noise, *observed, target);
                        count += 1.0;
                    }
                }
            });
        }
        (sum, count)
    }

    /// How all that is compared grows with a step of the signal along another, one number after the other, in units of their
    /// standard deviation where waves are compared, of which there are two numbers for each bin.
    pub(crate) fn along(&self, what: Compared, x: &[f64], step: &[f64], noise: &Noise, target: &Target) -> Vec<f64> {
        let mut all = Vec::new();
        for (w, (window, noise)) in self.windows.iter().zip(&noise.0).enumerate() {
            let mut own: Vec<Complex64> = Vec::with_capacity(noise.len());
            Self::frames(window, x, |_, bins| own.extend(bins));
            let mut at = own.iter().zip(noise).zip(&target.bins[w]);
            Self::frames(window, step, |_, bins| {
                for (d, ((x, n), observed)) in bins.iter().zip(&mut at) {
                    match what {
                        Compared::Magnitudes => all.push((d * x.conj()).re / (x.norm_sqr() + n + target.floor)),
                        Compared::Waves => {
                            let unit = (2.0 / Self::variance(*n, *observed, target)).sqrt();
                            all.extend([unit * d.re, unit * d.im]);
                        }
                    }
                }
            });
        }
        all
    }

    /// The sum of squares of [`Self::along`] by band, as that of as many numbers as there are samples.
    pub(crate) fn told(
        &self,
        what: Compared,
        x: &[f64],
        step: &[f64],
        noise: &Noise,
        target: &Target,
        bands: &Bands,
    ) -> [f64; BANDS] {
        let all = self.along(what, x, step, noise, target);
        let each = if what == Compared::Waves { 2 } else { 1 };
        let share = x.len() as f64 / all.len().max(1) as f64;
        let mut rows = all.iter();
        let mut told = [0.0; BANDS];
        for (window, logs) in self.windows.iter().zip(&target.logs) {
            let bins = window.bins.1 - window.bins.0;
            for k in (0..logs.len()).map(|at| window.bins.0 + at % bins) {
                let (below, fraction) = bands.place(k as f64 * self.rate_hz / window.hann.len() as f64);
                let square: f64 = rows.by_ref().take(each).map(|v| v * v).sum();
                told[below + usize::from(fraction > 0.5)] += share * square;
            }
        }
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Random;

    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut random = Random::new(seed, 0);
        (0..count).map(|_| random.normal()).collect()
    }

    #[test]
    fn its_derivatives_are_those_of_small_steps() {
        let (x, y) = (noise(5, 600), noise(6, 600));
        let loss = Loss::new(16_000.0, (200.0, 5000.0));
        let (target, bands) = (loss.target(&y), Bands::new(16_000.0));
        let chain: Vec<f64> = (0..65).map(|k| 1.0 + 0.01 * f64::from(k)).collect();
        let power = vec![[0.3; BANDS]; 40];
        for what in [Compared::Magnitudes, Compared::Waves] {
            derivatives(what, &loss, &target, &bands, &chain, &x, &power);
        }
    }

    fn derivatives(what: Compared, loss: &Loss, target: &Target, bands: &Bands, chain: &[f64], x: &[f64], power: &Power) {
        let value = |x: &[f64], power: &Power| loss.of(what, x, &loss.noise(power, bands, chain, target), target).0;
        let (at, by, by_noise) = loss.of(what, x, &loss.noise(power, bands, chain, target), target);
        assert!(at > 0.3);
        for i in [40, 300, 555] {
            let moved = |step: f64| {
                let mut moved = x.to_vec();
                moved[i] += step;
                value(&moved, power)
            };
            let step = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((step - by[i]).abs() < 2e-2 * by[i].abs().max(1e-3), "{what:?} {i}: {step} {}", by[i]);
        }
        let by_power = loss.by_power(&by_noise, power.len(), bands, chain);
        for (p, b) in [(2, 8), (9, 12), (15, 5)] {
            let moved = |step: f64| {
                let mut moved = power.clone();
                moved[p][b] += step;
                value(x, &moved)
            };
            let step = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            assert!((step - by_power[p][b]).abs() < 2e-2 * by_power[p][b].abs() + 1e-6, "{p} {b}: {step} {}", by_power[p][b]);
        }
        let mut unit = vec![0.0; 600];
        unit[300] = 1.0;
        let grown = loss.along(what, x, &unit, &loss.noise(power, bands, chain, target), target);
        assert!(grown.iter().any(|v| v.abs() > 1e-3));
    }

    #[test]
    fn noise_of_the_right_power_is_what_is_heard() {
        let y = noise(7, 4000);
        let loss = Loss::new(16_000.0, (0.0, 8000.0));
        let (target, bands) = (loss.target(&y), Bands::new(16_000.0));
        let mut best = (f64::INFINITY, 0.0);
        for power in [0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0] {
            let own = loss.noise(&vec![[power; BANDS]; 200], &bands, &[1.0; 65], &target);
            let value = loss.of(Compared::Magnitudes, &vec![0.0; 4000], &own, &target).0;
            best = if value < best.0 { (value, power) } else { best };
        }
        assert_eq!(best.1, 1.0);
        let still = loss.noise(&vec![[1e-4; BANDS]; 200], &bands, &[1.0; 65], &target);
        let apart = |x: &[f64]| {
            let (sum, count) = loss.agreement(x, &still, &target);
            sum / count
        };
        assert!(apart(&y) < 0.1 && apart(&noise(8, 4000)) > 30.0, "other waves do not agree");
    }
}
