//! Conversion between sample rates, offline: band-limited, and aligned in time with its input.

use crate::{FileError, narrow};
use rubato::audioadapter_buffers::direct::SequentialSliceOfVecs;
use rubato::{Fft, FixedSync, Resampler, WindowFunction};

/// Input samples per transform, at least: the transition band is a few hundredths of the lower Nyquist frequency.
const CHUNK: u32 = 2048;

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
    let failed = |source: Box<dyn std::error::Error + Send + Sync>| {
        FileError::because(format!("no conversion from {from_hz} to {to_hz} Hz"), source)
    };
    // The resampler's delay is half a transform, on both sides of it; an even number of the smallest blocks makes it whole
    // samples, and so exactly removable.
    let block = from_hz / gcd(from_hz, to_hz).max(1);
    let chunk = CHUNK.div_ceil(block.max(1)).next_multiple_of(2) as usize * block as usize;
    let mut resampler = Fft::<f32>::new_custom(
        from_hz as usize,
        to_hz as usize,
        chunk,
        1,
        channels.len(),
        WindowFunction::BlackmanHarris2,
        FixedSync::Both,
    )
    .map_err(|e| failed(Box::new(e)))?;
    let input = SequentialSliceOfVecs::new(channels, channels.len(), frames).map_err(|e| failed(Box::new(e)))?;
    let capacity = resampler.process_all_needed_output_len(frames);
    let mut output = vec![vec![0.0; capacity]; channels.len()];
    let mut adapter = SequentialSliceOfVecs::new_mut(&mut output, channels.len(), capacity).map_err(|e| failed(Box::new(e)))?;
    resampler.process_all_into_buffer(&input, &mut adapter, frames, None).map_err(|e| failed(Box::new(e)))?;
    // Counted in whole numbers: the resampler's own count rounds a ratio up.
    let length = (frames as u128 * u128::from(to_hz)).div_ceil(u128::from(from_hz.max(1)));
    output.iter_mut().for_each(|c| c.truncate(usize::try_from(length).unwrap_or(usize::MAX)));
    Ok(output)
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

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
