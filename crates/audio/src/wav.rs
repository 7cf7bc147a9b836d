//! WAV files of planar `f32`, written whole or block by block.

use crate::atomic::Draft;
use crate::samples::check_rate;
use crate::{FileError, file};
use hound::{SampleFormat, WavSpec};
use std::fs::File;
use std::io::{BufWriter, IsTerminal, stdout};
use std::path::Path;

/// A WAV file counts its bytes in 32 bits; this leaves room for its headers.
const MAX_DATA_BYTES: u64 = u32::MAX as u64 - 4096;

/// How samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 16-bit integers.
    Int16,
    /// 24-bit integers.
    Int24,
    /// 32-bit integers.
    Int32,
    /// 32-bit floats: no clipping, no rounding.
    Float32,
}

impl Format {
    fn bits(self) -> u16 {
        match self {
            Self::Int16 => 16,
            Self::Int24 => 24,
            Self::Int32 | Self::Float32 => 32,
        }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Samples per channel.
    pub frames: u64,
    /// Samples of all channels that integers could not hold and were limited to full scale.
    pub clipped: u64,
}

/// Writes a WAV file block by block; the file appears under its name only when [`WavWriter::finish`] succeeds.
///
/// Integers are rounded to the nearest value, without dither, and limited to full scale.
pub struct WavWriter {
    inner: hound::WavWriter<BufWriter<File>>,
    draft: Draft,
    format: Format,
    channels: u16,
    written: Written,
}

impl WavWriter {
    /// Begins a file.
    ///
    /// # Errors
    /// No channel, a name with another ending than `.wav`, a rate outside [`crate::sound::SAMPLE_RATES_HZ`], or a place that
    /// cannot be written to.
    pub fn create(path: &Path, sample_rate_hz: u32, channels: u16, format: Format) -> Result<Self, FileError> {
        Self::begin(path, sample_rate_hz, channels, format, Draft::create)
    }

    fn begin(
        path: &Path,
        sample_rate_hz: u32,
        channels: u16,
        format: Format,
        draft: impl Fn(&Path) -> Result<(Draft, File), FileError>,
    ) -> Result<Self, FileError> {
        if channels == 0 {
            return Err(FileError::content(path, "at least one channel", "none"));
        }
        if path.extension().is_some_and(|ending| !ending.eq_ignore_ascii_case("wav")) {
            let found = path.file_name().unwrap_or_default().display().to_string();
            return Err(FileError::content(path, "a name that ends in .wav, the format that is written", found));
        }
        check_rate(path, sample_rate_hz)?;
        if file::is_standard(path) && stdout().is_terminal() {
            return Err(FileError::content(path, "a file or a pipe as standard output", "a terminal"));
        }
        let (draft, file) = draft(path)?;
        let sample_format = if format == Format::Float32 { SampleFormat::Float } else { SampleFormat::Int };
        let spec = WavSpec { channels, sample_rate: sample_rate_hz, bits_per_sample: format.bits(), sample_format };
        let inner = hound::WavWriter::new(BufWriter::new(file), spec).map_err(|e| failed(&draft, e))?;
        Ok(Self { inner, draft, format, channels, written: Written { frames: 0, clipped: 0 } })
    }

    /// Appends a block, one slice per channel.
    ///
    /// # Errors
    /// A full disk, a file beyond 4 GiB, or a sample that is not finite.
    ///
    /// # Panics
    /// When the number of slices is not the number of channels, or their lengths differ.
    pub fn write(&mut self, block: &[&[f32]]) -> Result<(), FileError> {
        assert_eq!(block.len(), usize::from(self.channels), "one slice per channel");
        let frames = block[0].len();
        assert!(block.iter().all(|c| c.len() == frames), "slices of the same length");
        let bytes = (self.written.frames + frames as u64) * u64::from(self.channels) * u64::from(self.format.bits() / 8);
        if bytes > MAX_DATA_BYTES {
            let expected = "less than 4 GiB of samples, all that a WAV file holds";
            return Err(FileError::content(self.draft.target(), expected, "more"));
        }
        let full_scale = 2.0_f64.powi(i32::from(self.format.bits()) - 1);
        for frame in 0..frames {
            for (number, channel) in block.iter().enumerate() {
                let value = channel[frame];
                if !value.is_finite() {
                    let entry = format!("sample {} of channel {number}", self.written.frames + frame as u64);
                    return Err(FileError::entry(self.draft.target(), entry, "a finite number to write", format!("{value}")));
                }
                let done = if self.format == Format::Float32 {
                    self.inner.write_sample(value)
                } else {
                    let scaled = (f64::from(value) * full_scale).round();
                    let limited = scaled.clamp(-full_scale, full_scale - 1.0);
                    self.written.clipped += u64::from(scaled != limited);
                    #[expect(clippy::cast_possible_truncation, reason = "whole and limited to the range")]
                    self.inner.write_sample(limited as i32)
                };
                done.map_err(|e| failed(&self.draft, e))?;
            }
        }
        self.written.frames += frames as u64;
        Ok(())
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// A full disk, or a name that cannot be taken.
    pub fn finish(self) -> Result<Written, FileError> {
        self.inner.finalize().map_err(|e| failed(&self.draft, e))?;
        self.draft.publish()?;
        Ok(self.written)
    }
}

fn failed(draft: &Draft, error: hound::Error) -> FileError {
    let source = match error {
        hound::Error::IoError(source) => source,
        other => std::io::Error::other(other),
    };
    FileError::write(draft.target())(source)
}

/// Writes a whole WAV file, also over one that was read, as of a folder that goes on; `channels` are slices of the same length.
///
/// # Errors
/// A target that cannot be written, more channels or samples than a WAV file holds, a sample that is not finite.
pub fn write(path: &Path, sample_rate_hz: u32, channels: &[&[f32]], format: Format) -> Result<Written, FileError> {
    let count = u16::try_from(channels.len())
        .map_err(|_| FileError::content(path, "at most 65535 channels", format!("{}", channels.len())))?;
    let mut writer = WavWriter::begin(path, sample_rate_hz, count, format, Draft::replacing)?;
    writer.write(channels)?;
    writer.finish()
}
