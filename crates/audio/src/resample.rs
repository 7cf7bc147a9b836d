//! Conversion between sample rates, offline: band-limited, and aligned in time with its input.

use crate::{FileError, narrow};

/// Converts signals; sample 0 stays at time 0 and `n` samples become `n * to / from`, rounded up.
///
/// What lies above the lower of both Nyquist frequencies is removed.
///
/// # Errors
/// A rate of zero, or channels of different lengths.
pub fn signal(channels: &[Vec<f32>], from_hz: u32, to_hz: u32) -> Result<Vec<Vec<f32>>, FileError> {
    let frames = channels.first().map_or(0, Vec::len);
    if from_hz == to_hz || frames == 0 {
        return Ok(channels.to_vec());
    }
    let failed = |source| FileError::because(format!("no conversion from {from_hz} to {to_hz} Hz"), source);
    promenade_fourier::resampled(channels, from_hz as usize, to_hz as usize).map_err(failed)
}

/// Converts impulse responses: as [`signal`], scaled by `from / to` so that convolution at the new rate has the same gain.
///
/// # Errors
/// A rate of zero, or channels of different lengths.
pub fn response(channels: &[Vec<f32>], from_hz: u32, to_hz: u32) -> Result<Vec<Vec<f32>>, FileError> {
    let mut converted = signal(channels, from_hz, to_hz)?;
    let gain = narrow(f64::from(from_hz) / f64::from(to_hz));
    converted.iter_mut().flatten().for_each(|v| *v *= gain);
    Ok(converted)
}
