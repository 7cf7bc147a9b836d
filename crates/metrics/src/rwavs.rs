//! MAG as published with the RWAVS set (Liang et al. 2023, "AV-NeRF: Learning Neural Fields for Real-World Audio-Visual
//! Scene Synthesis", and its published evaluation): one-second clips at 22,050 Hz.
//!
//! Not comparable with the figures of [`crate::avcloud`], although both call themselves MAG.

use crate::{MetricError, Spectrogram, Window, check_pair};

/// The spectrogram of MAG: 512-point transform, hop 128, periodic Hann window; the clip is zero beyond its ends.
pub const SPECTROGRAM: Spectrogram = Spectrogram { n_fft: 512, hop: 128, window_length: 512, window: Window::Hann };

/// MAG: twice the mean squared difference of linear magnitudes over both ears.
///
/// # Errors
/// Signals of different lengths or with samples that are not finite.
pub fn mag(rendered: [&[f32]; 2], recorded: [&[f32]; 2]) -> Result<f64, MetricError> {
    let mut sum = 0.0;
    for (a, b) in rendered.iter().zip(recorded) {
        check_pair(a, b)?;
        let (a, b) = (SPECTROGRAM.magnitudes(a), SPECTROGRAM.magnitudes(b));
        // The mean over both ears, twice: the sum of the two ears' means.
        sum += a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64;
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    #[test]
    fn a_gain_costs_its_square() {
        let x: Vec<f32> = noise(13, 22_050).iter().map(|v| 0.1 * *v as f32).collect();
        let half: Vec<f32> = x.iter().map(|v| 0.5 * v).collect();
        let magnitudes = SPECTROGRAM.magnitudes(&x);
        let power = magnitudes.iter().map(|a| a * a).sum::<f64>() / magnitudes.len() as f64;
        let both = mag([&half, &half], [&x, &x]).unwrap();
        assert!((both - 2.0 * 0.25 * power).abs() < 1e-9 * power);
    }
}
