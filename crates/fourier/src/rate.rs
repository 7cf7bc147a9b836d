//! Conversion between sample rates: as a stream, block by block, and of whole signals.

use rubato::audioadapter_buffers::direct::SequentialSliceOfVecs;
use rubato::{Fft, FixedSync, Resampler, ResamplerConstructionError, WindowFunction};
use std::error::Error;

/// Samples of the longest block: rates whose ratio needs longer ones are not converted.
const LONGEST_BLOCK: usize = 4096;
/// Samples of a block on its shorter side, at least: the transition band is then a fifteenth of the lower Nyquist frequency.
const SHORTEST_BLOCK: usize = 256;
/// Samples that go into a transform of a whole signal, at least: its transition band is a few hundredths of the lower Nyquist
/// frequency.
const WHOLE_BLOCK: usize = 2048;

/// Channels of one length at another sample rate; sample 0 stays at time 0 and `n` samples become `n * to / from`, rounded up.
///
/// What lies above the lower of both Nyquist frequencies is removed.
///
/// # Errors
/// A rate of zero, or channels of different lengths.
pub fn resampled(channels: &[Vec<f32>], from_hz: usize, to_hz: usize) -> Result<Vec<Vec<f32>>, Box<dyn Error + Send + Sync>> {
    let (count, frames) = (channels.len(), channels.first().map_or(0, Vec::len));
    // The delay is half a transform, on both sides of it; an even number of the smallest blocks makes it whole samples, and so
    // exactly removable.
    let block = (from_hz / gcd(from_hz, to_hz).max(1)).max(1);
    let mut resampler = resampler(from_hz, to_hz, WHOLE_BLOCK.div_ceil(block).next_multiple_of(2) * block, count)?;
    let input = SequentialSliceOfVecs::new(channels, count, frames)?;
    let capacity = resampler.process_all_needed_output_len(frames);
    let mut output = vec![vec![0.0; capacity]; count];
    let mut adapter = SequentialSliceOfVecs::new_mut(&mut output, count, capacity)?;
    resampler.process_all_into_buffer(&input, &mut adapter, frames, None)?;
    // Counted in whole numbers: the resampler's own count rounds a ratio up.
    let length = (frames as u128 * to_hz as u128).div_ceil(from_hz as u128);
    output.iter_mut().for_each(|c| c.truncate(usize::try_from(length).unwrap_or(usize::MAX)));
    Ok(output)
}

/// A resampler of blocks of so many samples that go in.
fn resampler(from_hz: usize, to_hz: usize, block: usize, channels: usize) -> Result<Fft<f32>, ResamplerConstructionError> {
    Fft::new_custom(from_hz, to_hz, block, 1, channels, WindowFunction::BlackmanHarris2, FixedSync::Both)
}

/// Converts channels from one sample rate to another, a block of so many samples at a time.
///
/// What lies above the lower of both Nyquist frequencies is removed, from 0.93 of it on. Blocks of both rates last equally
/// long, and what comes out is later than what goes in by exactly half a block.
pub struct RateConverter {
    resampler: Fft<f32>,
    /// Samples that come out of the shortest stretch that is a whole number of samples at both rates.
    shortest: usize,
    input: Vec<Vec<f32>>,
    output: Vec<Vec<f32>>,
}

impl RateConverter {
    /// `None` for rates that are no whole numbers of hertz, or whose ratio needs blocks of more than 4,096 samples. Making one
    /// allocates, using it does not.
    #[must_use]
    pub fn new(from_hz: f64, to_hz: f64, channels: usize) -> Option<Self> {
        let [from, to] = [from_hz, to_hz].map(whole_hz);
        let (from, to) = (from?, to?);
        let divisor = gcd(from, to);
        let shorter = from.min(to) / divisor;
        // An even number of the smallest blocks makes half a block a whole number of samples at both rates.
        let count = SHORTEST_BLOCK.div_ceil(shorter).next_multiple_of(2);
        let [input, output] = [from, to].map(|hz| hz / divisor * count);
        if input.max(output) > LONGEST_BLOCK {
            return None;
        }
        let resampler = resampler(from, to, input, channels).ok()?;
        let silent = |len: usize| vec![vec![0.0; len]; channels];
        Some(Self { resampler, shortest: to / divisor, input: silent(input), output: silent(output) })
    }

    /// Samples of a block that goes in, and of one that comes out.
    #[must_use]
    pub fn block(&self) -> [usize; 2] {
        [&self.input, &self.output].map(|side| side.first().map_or(0, Vec::len))
    }

    /// Samples that come out of the shortest stretch that is a whole number of samples at both rates.
    #[must_use]
    pub fn shortest(&self) -> usize {
        self.shortest
    }

    /// The place of a channel's next block.
    pub fn input(&mut self, channel: usize) -> &mut [f32] {
        &mut self.input[channel]
    }

    /// Converts the block. Does not allocate.
    pub fn convert(&mut self) {
        let [from, to] = self.block();
        let channels = self.input.len();
        let input = SequentialSliceOfVecs::new(&self.input, channels, from);
        let output = SequentialSliceOfVecs::new_mut(&mut self.output, channels, to);
        if let (Ok(input), Ok(mut output)) = (input, output) {
            // The sizes are those that it was made for, so its only errors cannot occur.
            let done = self.resampler.process_into_buffer(&input, &mut output, None);
            debug_assert!(done.is_ok());
        }
    }

    /// A channel of the block that was converted last.
    #[must_use]
    pub fn output(&self, channel: usize) -> &[f32] {
        &self.output[channel]
    }

    /// Forgets what went in.
    pub fn reset(&mut self) {
        self.resampler.reset();
    }

    /// Bytes in memory, about.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let [from, to] = self.block();
        // Blocks, their copies, overlaps and spectra.
        size_of::<f32>() * (3 * self.input.len() * (from + to) + 8 * (from + to))
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be a whole number within its range")]
fn whole_hz(hz: f64) -> Option<usize> {
    (hz.fract() == 0.0 && (1.0..1e7).contains(&hz)).then_some(hz as usize)
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
