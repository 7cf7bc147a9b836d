//! Filters of given magnitudes that ring as little as they can.

use super::head::Grid;
use super::{BoxRoom, OCTAVES_HZ};
use promenade_fourier::num_complex::{Complex32, Complex64};

/// Amplitude that stands for nothing, whose logarithm would be infinite.
const LEAST_AMPLITUDE: f64 = 1e-5;
/// Oversampling of the frequencies, against the cepstrum's folding onto itself.
const OVERSAMPLING: usize = 8;

/// Complex logarithms of the walls' reflection, by bin.
pub(super) fn walls(room: &BoxRoom, grid: Grid) -> [Vec<Complex32>; 6] {
    room.absorption.map(|absorption| {
        let amplitude = |hz: f64| {
            let absorbed = octave(&absorption, hz);
            (1.0 - absorbed).max(0.0).sqrt().max(LEAST_AMPLITUDE).ln()
        };
        log_spectrum(grid, amplitude)
    })
}

/// A value by octave at a frequency: linear over the logarithm of the frequency, held beyond the ends.
pub(super) fn octave(values: &[f32; 7], hz: f64) -> f64 {
    let (below, fraction) = octave_place(hz);
    let [a, b] = [values[below], values[below + 1]].map(f64::from);
    a + fraction * (b - a)
}

/// The octave below a frequency and how far it is on the way to the next.
pub(super) fn octave_place(hz: f64) -> (usize, f64) {
    let last = OCTAVES_HZ.len() - 1;
    let place = (hz.max(1.0) / f64::from(OCTAVES_HZ[0])).log2().clamp(0.0, last as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the octaves")]
    let below = (place as usize).min(last - 1);
    (below, place - below as f64)
}

/// The complex logarithm, by bin, of the minimum-phase filter whose amplitude has this logarithm (Oppenheim and Schafer, homomorphic
/// deconvolution: the cepstrum folded to positive times).
pub(super) fn log_spectrum(grid: Grid, log_amplitude: impl Fn(f64) -> f64) -> Vec<Complex32> {
    let n = OVERSAMPLING * grid.n_fft;
    let (forward, inverse) = (promenade_fourier::forward::<f64>(n), promenade_fourier::inverse::<f64>(n));
    let hz = |k: usize| k as f64 * grid.sample_rate_hz / n as f64;
    let mut spectrum: Vec<Complex64> = (0..=n / 2).map(|k| Complex64::new(log_amplitude(hz(k)), 0.0)).collect();
    let mut cepstrum = inverse.make_output_vec();
    // Lengths are the plans' own and the ends real, the only things that the transforms check.
    let done = inverse.process(&mut spectrum, &mut cepstrum);
    debug_assert!(done.is_ok());
    for (i, c) in cepstrum.iter_mut().enumerate() {
        let fold = if i == 0 || i == n / 2 { 1.0 } else { f64::from(u8::from(i < n / 2)) * 2.0 };
        *c *= fold / n as f64;
    }
    let done = forward.process(&mut cepstrum, &mut spectrum);
    debug_assert!(done.is_ok());
    #[expect(clippy::cast_possible_truncation, reason = "spectra are f32")]
    spectrum.iter().step_by(OVERSAMPLING).map(|c| Complex32::new(c.re as f32, c.im as f32)).collect()
}
