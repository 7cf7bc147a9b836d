//! Short-time magnitude spectra for measuring, and the distances between them.

use crate::{MetricError, check_pair};
use promenade_fourier::Fourier;
use std::f64::consts::PI;

/// Shape of an analysis window, periodic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// 0.5 - 0.5 cos.
    Hann,
    /// 0.54 - 0.46 cos.
    Hamming,
}

impl Window {
    fn samples(self, count: usize) -> impl Iterator<Item = f64> {
        let (a, b) = match self {
            Self::Hann => (0.5, 0.5),
            Self::Hamming => (0.54, 0.46),
        };
        (0..count).map(move |i| a - b * (2.0 * PI * i as f64 / count as f64).cos())
    }
}

/// How a spectrogram is made. Frames are centred on multiples of the hop; the signal is zero beyond its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spectrogram {
    /// Transform length, samples.
    pub n_fft: usize,
    /// Step from frame to frame, samples, at least 1.
    pub hop: usize,
    /// Window length, samples, at most `n_fft`; a shorter window stands in the middle of the frame.
    pub window_length: usize,
    /// Window shape.
    pub window: Window,
}

impl Spectrogram {
    /// Frames for a signal of `length` samples.
    #[must_use]
    pub fn frames(&self, length: usize) -> usize {
        1 + length / self.hop
    }

    /// Magnitudes, frame after frame of `n_fft / 2 + 1` bins, linear and unscaled (a window's sum is not divided out).
    #[must_use]
    pub fn magnitudes(&self, samples: &[f32]) -> Vec<f64> {
        let fourier = Fourier::new(self.n_fft);
        let mut frame_window = vec![0.0; self.n_fft];
        let inset = (self.n_fft - self.window_length) / 2;
        for (slot, w) in frame_window[inset..].iter_mut().zip(self.window.samples(self.window_length)) {
            *slot = w;
        }
        let mut magnitudes = Vec::with_capacity(self.frames(samples.len()) * (self.n_fft / 2 + 1));
        for frame in 0..self.frames(samples.len()) {
            let spectrum = fourier.spectrum((0..self.n_fft).map(|i| {
                let at = (frame * self.hop + i).checked_sub(self.n_fft / 2);
                at.and_then(|at| samples.get(at)).map_or(0.0, |&v| f64::from(v) * frame_window[i])
            }));
            magnitudes.extend(spectrum.iter().map(|c| c.norm()));
        }
        magnitudes
    }
}

/// Magnitudes below this count as this in [`lsd_db`].
pub const LSD_EPS: f64 = 1e-5;

/// Log-spectral distance, dB: the mean over frames of the root mean square over bins of `20 log10(A / B)`.
///
/// Magnitudes are floored at [`LSD_EPS`]; the figure depends on that floor and on the spectrogram, so quote both.
///
/// # Errors
/// Signals of different lengths or with samples that are not finite.
pub fn lsd_db(first: &[f32], second: &[f32], of: Spectrogram) -> Result<f64, MetricError> {
    check_pair(first, second)?;
    let bins = of.n_fft / 2 + 1;
    let (a, b) = (of.magnitudes(first), of.magnitudes(second));
    let frames = a.chunks_exact(bins).zip(b.chunks_exact(bins)).map(|(a, b)| {
        let square: f64 = a.iter().zip(b).map(|(a, b)| (20.0 * (a.max(LSD_EPS) / b.max(LSD_EPS)).log10()).powi(2)).sum();
        (square / bins as f64).sqrt()
    });
    Ok(frames.sum::<f64>() / of.frames(first.len()) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;
    use promenade_fourier::num_complex::Complex;

    const SPECTROGRAM: Spectrogram = Spectrogram { n_fft: 512, hop: 160, window_length: 400, window: Window::Hamming };

    #[test]
    fn a_direct_transform_agrees() {
        let x: Vec<f32> = noise(5, 1000).iter().map(|v| *v as f32).collect();
        let magnitudes = SPECTROGRAM.magnitudes(&x);
        assert_eq!(magnitudes.len(), 7 * 257);
        let (frame, bin) = (3_usize, 40_usize);
        let mut sum = Complex::new(0.0, 0.0);
        for i in 0..400_usize {
            let w = 0.54 - 0.46 * (2.0 * PI * i as f64 / 400.0).cos();
            let v = f64::from(x[frame * 160 + 56 + i - 256]);
            sum += Complex::from_polar(w * v, -2.0 * PI * (bin * (i + 56)) as f64 / 512.0);
        }
        assert!((magnitudes[frame * 257 + bin] - sum.norm()).abs() < 1e-10);
    }

    #[test]
    fn a_gain_is_its_distance_in_db() {
        let x: Vec<f32> = noise(7, 4000).iter().map(|v| *v as f32).collect();
        let half: Vec<f32> = x.iter().map(|v| 0.5 * v).collect();
        assert!((lsd_db(&x, &half, SPECTROGRAM).unwrap() - 20.0 * 2.0_f64.log10()).abs() < 1e-6);
        assert_eq!(lsd_db(&x, &x, SPECTROGRAM), Ok(0.0));
    }
}
