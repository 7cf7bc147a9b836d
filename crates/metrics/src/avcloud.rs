//! MAG, LRE and ENV as AV-Cloud evaluates RWAVS clips (Chen et al. 2024, "AV-Cloud: Spatial Audio Rendering Through
//! Audio-Visual Cloud Splatting", and its published evaluation): one-second clips at 22,050 Hz, the recording cut to the
//! rendering's length.
//!
//! Not comparable with the figures of [`crate::rwavs`], although both call themselves MAG.

use crate::{MetricError, Spectrogram, Window, check_pair, energy, envelope_distance};

/// The spectrogram of MAG: 512-point transform, hop 160, periodic Hamming window of 400 samples.
pub const SPECTROGRAM: Spectrogram = Spectrogram { n_fft: 512, hop: 160, window_length: 400, window: Window::Hamming };

/// Added to the energies of LRE.
const LRE_EPS: f64 = 1e-5;

/// MAG: the mean absolute difference of linear magnitudes, summed over the two ears.
///
/// # Errors
/// Signals of different lengths or with samples that are not finite.
pub fn mag(rendered: [&[f32]; 2], recorded: [&[f32]; 2]) -> Result<f64, MetricError> {
    let mut sum = 0.0;
    for (a, b) in rendered.iter().zip(recorded) {
        check_pair(a, b)?;
        let (a, b) = (SPECTROGRAM.magnitudes(a), SPECTROGRAM.magnitudes(b));
        sum += a.iter().zip(&b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64;
    }
    Ok(sum)
}

/// LRE: the absolute difference of the left to right energy ratios, dB. Energies are sums over the clip plus 1e-5.
///
/// # Errors
/// Signals of different lengths or with samples that are not finite.
pub fn lre_db(rendered: [&[f32]; 2], recorded: [&[f32]; 2]) -> Result<f64, MetricError> {
    for (a, b) in rendered.iter().zip(recorded) {
        check_pair(a, b)?;
    }
    let ratio = |ears: [&[f32]; 2]| 10.0 * ((energy(ears[0]) + LRE_EPS) / (energy(ears[1]) + LRE_EPS)).log10();
    Ok((ratio(rendered) - ratio(recorded)).abs())
}

/// ENV: the root mean square difference of the envelopes, summed over the two ears.
///
/// # Errors
/// Empty signals, different lengths or samples that are not finite.
pub fn env(rendered: [&[f32]; 2], recorded: [&[f32]; 2]) -> Result<f64, MetricError> {
    Ok(envelope_distance(rendered[0], recorded[0])? + envelope_distance(rendered[1], recorded[1])?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    #[test]
    fn nothing_differs_from_itself_and_a_gain_shows() {
        let x: Vec<f32> = noise(11, 22_050).iter().map(|v| 0.1 * *v as f32).collect();
        let half: Vec<f32> = x.iter().map(|v| 0.5 * v).collect();
        let (same, softer) = ([&x[..], &x[..]], [&half[..], &x[..]]);
        assert_eq!((mag(same, same), lre_db(same, same), env(same, same)), (Ok(0.0), Ok(0.0), Ok(0.0)));
        // Halving one ear costs half of its mean magnitude.
        let mean = SPECTROGRAM.magnitudes(&x).iter().sum::<f64>() / SPECTROGRAM.magnitudes(&x).len() as f64;
        assert!((mag(softer, same).unwrap() - 0.5 * mean).abs() < 1e-6);
        assert!((lre_db(softer, same).unwrap() - 20.0 * 2.0_f64.log10()).abs() < 1e-3);
    }
}
