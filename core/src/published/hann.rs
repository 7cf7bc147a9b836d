//! Frames of the published transform: periodic Hann window in analysis and synthesis.

use crate::StftGrid;
use crate::number::single;
use crate::published::error::PublishedError;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use pulp::{Arch, Simd, WithSimd};
use std::sync::Arc;

/// Largest transform length that is taken.
const MAX_FFT: usize = 1 << 16;
/// Highest sample rate that is taken, Hz.
const MAX_RATE_HZ: f64 = 1e6;

/// Transforms frames of a grid one by one; the sums of overlapping frames are the caller's.
pub(crate) struct HannFrames {
    arch: Arch,
    window: Vec<f32>,
    frame: Vec<f32>,
    scratch: Vec<Complex32>,
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl HannFrames {
    /// # Errors
    /// The grid's hop or transform length is not usable.
    pub(crate) fn new(grid: &StftGrid, arch: Arch) -> Result<Self, PublishedError> {
        let n = grid.n_fft;
        let rate_fits = (1.0..=MAX_RATE_HZ).contains(&grid.sample_rate_hz);
        if !(2..=MAX_FFT).contains(&n) || !n.is_multiple_of(2) || !(1..=n / 2).contains(&grid.hop) || !rate_fits {
            return Err(PublishedError::Grid { n_fft: n, hop: grid.hop, sample_rate_hz: grid.sample_rate_hz });
        }
        let (forward, inverse) = (promenade_fourier::forward(n), promenade_fourier::inverse(n));
        let scratch = forward.get_scratch_len().max(inverse.get_scratch_len());
        let hann = |i: usize| single(0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / n as f64).cos());
        Ok(Self {
            arch,
            window: (0..n).map(hann).collect(),
            frame: vec![0.0; n],
            scratch: vec![Complex32::default(); scratch],
            forward,
            inverse,
        })
    }

    /// Weight of each sample of a frame that has gone through analysis and synthesis: divide by the sum over frames.
    pub(crate) fn squared_window(&self) -> impl Iterator<Item = f32> {
        self.window.iter().map(|w| w * w)
    }

    /// Spectrum of one frame of samples.
    pub(crate) fn analyse(&mut self, samples: &[f32], spectrum: &mut [Complex32]) {
        for ((f, x), w) in self.frame.iter_mut().zip(samples).zip(&self.window) {
            *f = x * w;
        }
        // The lengths are fixed at construction, so the transform's only error cannot occur.
        let done = self.forward.process_with_scratch(&mut self.frame, spectrum, &mut self.scratch);
        debug_assert!(done.is_ok());
    }

    /// Adds one windowed frame to sums of samples. The spectrum is overwritten.
    pub(crate) fn synthesise(&mut self, spectrum: &mut [Complex32], sums: &mut [f32]) {
        // A real signal's end bins are real; the inverse transform insists on it.
        let last = spectrum.len() - 1;
        spectrum[0].im = 0.0;
        spectrum[last].im = 0.0;
        let done = self.inverse.process_with_scratch(spectrum, &mut self.frame, &mut self.scratch);
        debug_assert!(done.is_ok());
        let scale = 1.0 / self.frame.len() as f32;
        for ((s, f), w) in sums.iter_mut().zip(&self.frame).zip(&self.window) {
            *s += scale * f * w;
        }
    }

    /// Magnitudes of a spectrum.
    pub(crate) fn magnitudes(&self, spectrum: &[Complex32], out: &mut [f32]) {
        self.arch.dispatch(Magnitudes { spectrum, out });
    }

    /// A spectrum of the wanted magnitudes with the phase of `spectrum`, whose own magnitudes are given; the phase of zero is
    /// 0.
    pub(crate) fn with_phase(&self, wanted: &[f32], spectrum: &[Complex32], magnitudes: &[f32], out: &mut [Complex32]) {
        self.arch.dispatch(WithPhase { wanted, spectrum, magnitudes, out });
    }
}

struct Magnitudes<'a> {
    spectrum: &'a [Complex32],
    out: &'a mut [f32],
}

impl WithSimd for Magnitudes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let mut smallest = f32::MAX;
        for (m, x) in self.out.iter_mut().zip(self.spectrum) {
            let square = x.re * x.re + x.im * x.im;
            smallest = smallest.min(square);
            *m = square.sqrt();
        }
        // Squares of small numbers lose digits or vanish.
        if smallest < 1e-30 {
            for (m, x) in self.out.iter_mut().zip(self.spectrum) {
                if *m < 1e-15 {
                    *m = x.re.hypot(x.im);
                }
            }
        }
    }
}

struct WithPhase<'a> {
    wanted: &'a [f32],
    spectrum: &'a [Complex32],
    magnitudes: &'a [f32],
    out: &'a mut [Complex32],
}

impl WithSimd for WithPhase<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        for (((y, m), x), magnitude) in self.out.iter_mut().zip(self.wanted).zip(self.spectrum).zip(self.magnitudes) {
            let (re, im) = (x.re / magnitude, x.im / magnitude);
            let silent = *magnitude == 0.0;
            *y = Complex32::new(m * if silent { 1.0 } else { re }, m * if silent { 0.0 } else { im });
        }
    }
}
