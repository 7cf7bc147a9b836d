//! Short-time spectra of clips, and sound of them again.

use promenade_fourier::{Fourier, signal};

/// Length of the transform, samples, as AV-NeRF has it; its hop of 127 is 128 here, which overlaps evenly.
pub(crate) const N_FFT: usize = 512;
pub(crate) const HOP: usize = N_FFT / 4;
/// Bins of a spectrum.
pub(crate) const BINS: usize = N_FFT / 2 + 1;
/// Squared Hann windows at a quarter of their length add up to this.
const OVERLAP: f32 = 1.5;

/// A periodic Hann window.
fn window(i: usize) -> f32 {
    0.5 - 0.5 * (std::f32::consts::TAU * i as f32 / N_FFT as f32).cos()
}

/// One frame, windowed; zeros outside of the sound.
fn frame(x: &[f32], number: usize) -> impl Iterator<Item = f32> {
    let start = (number * HOP) as i64 - (N_FFT / 2) as i64;
    (0..N_FFT).map(move |i| {
        let sample = usize::try_from(start + i as i64).ok().and_then(|at| x.get(at));
        window(i) * sample.copied().unwrap_or(0.0)
    })
}

fn frames(samples: usize) -> usize {
    samples / HOP + 1
}

/// Magnitudes, `[frame][bin]`; the frames' middles are a hop apart, the first at the first sample.
pub(crate) fn magnitudes(x: &[f32]) -> Vec<Vec<f32>> {
    let fourier = Fourier::new(N_FFT);
    let of = |number| fourier.spectrum(frame(x, number)).iter().map(|value| value.norm()).collect();
    (0..frames(x.len())).map(of).collect()
}

/// The sound with a gain for each bin, as long as it was.
pub(crate) fn with_gains(x: &[f32], gains: &[f32]) -> Vec<f32> {
    let fourier = Fourier::new(N_FFT);
    let mut out = vec![0.0; x.len()];
    for number in 0..frames(x.len()) {
        let mut spectrum = fourier.spectrum(frame(x, number));
        spectrum.iter_mut().zip(gains).for_each(|(value, gain)| *value *= *gain);
        let start = (number * HOP) as i64 - (N_FFT / 2) as i64;
        for (i, value) in signal(spectrum, N_FFT).into_iter().enumerate() {
            if let Some(sum) = usize::try_from(start + i as i64).ok().and_then(|at| out.get_mut(at)) {
                *sum += window(i) * value / OVERLAP;
            }
        }
    }
    out
}
