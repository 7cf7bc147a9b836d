//! One measured response of a room, whatever file it is in.

use crate::error::SofaError;
use crate::file::{Sofa, SofaOptions};
use promenade_audio::sound;
use std::path::Path;

/// Samples of all channels of a sound file together, at most.
const MAX_SAMPLES: u64 = 1 << 26;

/// The response in a WAV file, or the first of a SOFA file: samples by channel, and their rate in hertz.
///
/// # Errors
/// A file that cannot be read, is neither, or is damaged; silence. The message names the file, what was expected and what was
/// found.
pub fn read_measured(path: &Path) -> Result<(Vec<Vec<f32>>, f64), SofaError> {
    let is_sofa = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("sofa"));
    let (channels, rate_hz) = if is_sofa { first(path)? } else { of_sound(path)? };
    if channels.iter().flatten().all(|v| *v == 0.0) {
        return Err(SofaError::content(path, "a response", "silence"));
    }
    Ok((channels, rate_hz))
}

fn of_sound(path: &Path) -> Result<(Vec<Vec<f32>>, f64), SofaError> {
    let wav = sound::read_limited(path, MAX_SAMPLES)?;
    Ok((wav.channels, f64::from(wav.sample_rate_hz)))
}

fn first(path: &Path) -> Result<(Vec<Vec<f32>>, f64), SofaError> {
    let sofa = Sofa::open(path)?;
    let options = SofaOptions { source: Some(0), ..SofaOptions::default() };
    let mut found = None;
    let mut keep = |one: crate::Recorded| {
        found.get_or_insert(one.channels);
    };
    // Capsules of a microphone or Ambisonic channels; what has two places is a head.
    let about = match sofa.of_harmonics(options, &mut keep) {
        Ok(about) => about,
        Err(no_harmonics) => sofa.of_ears(options, &mut keep).map_err(|_| no_harmonics)?.0,
    };
    let channels = found.ok_or_else(|| SofaError::content(path, "at least one response", "none"))?;
    Ok((channels, about.sample_rate_hz))
}
