//! Filters of given magnitudes that ring as little as they can.

use crate::{signal, spectrum};
use realfft::num_complex::Complex64;

/// Gains below this count as silence (-140 dB).
pub const NO_GAIN: f64 = 1e-7;

/// Log of a magnitude, no lower than 60 dB below its peak: a deeper notch would only lengthen the response.
pub fn floored_log(gain: &[f64]) -> impl Iterator<Item = f64> {
    let floor = 1e-3 * gain.iter().fold(NO_GAIN, |a, b| a.max(*b));
    gain.iter().map(move |g| g.max(floor).ln())
}

/// The complex logarithm of the minimum-phase filter whose magnitude has this natural logarithm, both by bin from 0 to half of
/// an even `n_fft`: the cepstrum folded to positive times (Oppenheim and Schafer 2010, section 13.5).
#[must_use]
pub fn minimum_phase_log(log_gain: impl IntoIterator<Item = f64>, n_fft: usize) -> Vec<Complex64> {
    let mut cepstrum = signal(log_gain.into_iter().map(Complex64::from).collect(), n_fft);
    let (positive, negative) = cepstrum.split_at_mut(n_fft / 2);
    positive.iter_mut().skip(1).for_each(|c| *c *= 2.0);
    negative.iter_mut().skip(1).for_each(|c| *c = 0.0);
    spectrum(cepstrum, n_fft)
}

/// The phase alone, radians, unwrapped.
pub fn minimum_phase(log_gain: impl IntoIterator<Item = f64>, n_fft: usize) -> impl Iterator<Item = f32> {
    minimum_phase_log(log_gain, n_fft).into_iter().map(|log| log.im as f32)
}
