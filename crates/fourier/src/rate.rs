//! Conversion between sample rates as a stream, block by block.

use rubato::audioadapter_buffers::direct::SequentialSliceOfVecs;
use rubato::{Fft, FixedSync, Resampler, WindowFunction};

/// Samples of the longest block: rates whose ratio needs longer ones are not converted.
const LONGEST_BLOCK: usize = 4096;
/// Samples of a block on its shorter side, at least: the transition band is then a fifteenth of the lower Nyquist frequency.
const SHORTEST_BLOCK: usize = 256;

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
        let window = WindowFunction::BlackmanHarris2;
        let resampler = Fft::new_custom(from, to, input, 1, channels, window, FixedSync::Both).ok()?;
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
