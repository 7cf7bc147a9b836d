//! Spectra of whole signals, and back. All of it allocates.

use crate::{Sample, forward, inverse};
use realfft::RealToComplex;
use realfft::num_complex::Complex;
use std::sync::Arc;

/// A forward transform of one length.
#[derive(Clone)]
pub struct Fourier<T: Sample>(Arc<dyn RealToComplex<T>>);

impl<T: Sample> Fourier<T> {
    /// A transform of `length` samples, at least 1.
    #[must_use]
    pub fn new(length: usize) -> Self {
        Self(forward(length))
    }

    /// The spectrum of a signal, zero-padded (or cut) to the transform's length: bins 0 to half the length, unscaled.
    #[must_use]
    pub fn spectrum(&self, signal: impl IntoIterator<Item = T>) -> Vec<Complex<T>> {
        let mut time = self.0.make_input_vec();
        time.iter_mut().zip(signal).for_each(|(slot, v)| *slot = v);
        let mut spectrum = self.0.make_output_vec();
        let done = self.0.process(&mut time, &mut spectrum);
        debug_assert!(done.is_ok(), "the buffers come from the plan");
        spectrum
    }
}

/// The spectrum of a signal, zero-padded (or cut) to `length` samples: bins 0 to half the length, unscaled.
#[must_use]
pub fn spectrum<T: Sample>(signal: impl IntoIterator<Item = T>, length: usize) -> Vec<Complex<T>> {
    Fourier::new(length).spectrum(signal)
}

/// The signal of `length` samples that has a spectrum: the inverse of [`spectrum`], scaled by `1 / length`.
///
/// The imaginary parts of the constant and, for an even length, of the Nyquist bin are ignored. A spectrum of fewer than
/// `length / 2 + 1` bins is zero above them.
#[must_use]
pub fn signal<T: Sample>(mut spectrum: Vec<Complex<T>>, length: usize) -> Vec<T> {
    let plan = inverse(length);
    spectrum.resize(length / 2 + 1, Complex::new(T::zero(), T::zero()));
    spectrum[0].im = T::zero();
    if length.is_multiple_of(2) {
        spectrum[length / 2].im = T::zero();
    }
    let mut time = plan.make_output_vec();
    let done = plan.process(&mut spectrum, &mut time);
    debug_assert!(done.is_ok(), "the buffers fit the plan, and the ends of the spectrum are real");
    let scale = T::from_usize(length).unwrap_or(T::one());
    time.iter_mut().for_each(|v| *v = *v / scale);
    time
}
