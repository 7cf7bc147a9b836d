//! The temporal composite: two pictures, blended at each moment's weight of a sound. Harvey, Debattista, Bashford-Rogers and
//! Chalmers, "Multi-modal perception for selective rendering", Computer Graphics Forum 2017, section 4.3.5.

use promenade_audio::{FileError, resample, sound};
use promenade_fault::Fault;
use promenade_metrics::{SALIENCY_RATE_HZ, picture_weights, saliency};
use std::path::Path;

/// Weights that the page has of a second of sound; between them it draws a line.
pub(crate) const WEIGHTS_HZ: f64 = 25.0;

/// How much each moment of a file of sound stands out, and its length in seconds: the saliency of the mean of its channels, a
/// value each [`SALIENCY_STEP_S`](promenade_metrics::SALIENCY_STEP_S).
///
/// # Errors
/// A file that cannot be read, or is silent.
pub fn sound_saliency(path: &Path) -> Result<(Vec<f64>, f64), Fault> {
    let heard = sound::read(path)?;
    let count = heard.channels.len().max(1) as f32;
    let mean: Vec<f32> = (0..heard.frames()).map(|i| heard.channels.iter().map(|c| c[i]).sum::<f32>() / count).collect();
    let seconds = mean.len() as f64 / f64::from(heard.sample_rate_hz);
    let mono = resample::signal(&[mean], heard.sample_rate_hz, SALIENCY_RATE_HZ)?;
    Ok((saliency(&mono[0]).map_err(FileError::at(path, "no saliency"))?, seconds))
}

/// Weights of a sound for the page, 0 to 1, [`WEIGHTS_HZ`] of them a second.
pub(crate) fn weights(path: &Path) -> Result<Vec<f64>, Fault> {
    let (trace, seconds) = sound_saliency(path)?;
    let weights = picture_weights(&trace, WEIGHTS_HZ, (seconds * WEIGHTS_HZ).ceil() as usize + 1);
    Ok(weights.into_iter().map(|weight| (weight * 1e4).round() / 1e4).collect())
}
