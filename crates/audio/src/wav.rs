//! WAV files as planar `f32`: whole, or block by block for files longer than memory.

use crate::atomic::Draft;
use crate::chunks::Chunks;
use crate::{FileError, file, narrow};
use hound::{SampleFormat, WavSpec};
use std::fs::File;
use std::io::{BufReader, BufWriter, Chain, Cursor, Read, Seek, SeekFrom, Take};
use std::path::{Path, PathBuf};

/// Sample rates that are believed, hertz.
pub const SAMPLE_RATES_HZ: std::ops::RangeInclusive<u32> = 1_000..=1_000_000;
/// Samples of all channels that [`read`] takes into memory: 1 GiB of `f32`.
pub const MAX_SAMPLES: u64 = 1 << 28;
/// A WAV file counts its bytes in 32 bits; this leaves room for its headers.
const MAX_DATA_BYTES: u64 = u32::MAX as u64 - 4096;

/// A whole WAV file.
#[derive(Clone, Debug, PartialEq)]
pub struct Wav {
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// Samples of each channel, full scale 1, all of the same length.
    pub channels: Vec<Vec<f32>>,
}

impl Wav {
    /// Samples per channel.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.channels.first().map_or(0, Vec::len)
    }
}

/// Whether the rate of a file is believed.
pub(crate) fn check_rate(path: &Path, sample_rate_hz: u32) -> Result<(), FileError> {
    let (low, high) = (SAMPLE_RATES_HZ.start(), SAMPLE_RATES_HZ.end());
    let wrong = || FileError::content(path, format!("a sample rate of {low} to {high} Hz"), format!("{sample_rate_hz} Hz"));
    SAMPLE_RATES_HZ.contains(&sample_rate_hz).then_some(()).ok_or_else(wrong)
}

/// Reads a whole WAV file (RIFF, RF64 or BW64): integers in containers of 8, 16, 24 or 32 bits or 32-bit floats, any number of
/// channels.
///
/// # Errors
/// A file that is missing, no regular file, empty, damaged, cut short or holds more than [`MAX_SAMPLES`] samples; a rate
/// outside [`SAMPLE_RATES_HZ`]; a sample that is not finite. The message names the file, what was expected and what was found.
pub fn read(path: &Path) -> Result<Wav, FileError> {
    read_limited(path, MAX_SAMPLES)
}

/// [`read`] with another limit on the samples of all channels together.
///
/// # Errors
/// Those of [`read`], with the other limit.
pub fn read_limited(path: &Path, max_samples: u64) -> Result<Wav, FileError> {
    let mut reader = WavReader::open(path)?;
    let samples = u64::from(reader.frames()) * u64::from(reader.channels());
    if samples > max_samples {
        return Err(FileError::content(path, format!("at most {max_samples} samples"), format!("{samples}")));
    }
    let mut channels = vec![Vec::new(); usize::from(reader.channels())];
    reader.read(reader.frames() as usize, &mut channels)?;
    Ok(Wav { sample_rate_hz: reader.sample_rate_hz(), channels })
}

/// A plain header, and the samples of a file.
type Samples = BufReader<Chain<Cursor<Vec<u8>>, Take<File>>>;

/// Reads a WAV file of up to 4 GiB block by block.
pub struct WavReader {
    inner: hound::WavReader<Samples>,
    path: PathBuf,
    position: u32,
}

impl WavReader {
    /// Opens a file and checks its header against its size.
    ///
    /// # Errors
    /// Those of [`read`], but for what shows only in the samples; 4 GiB of samples or more.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let mut file = file::open(path).map_err(FileError::read(path))?;
        let size = file.metadata().map_err(FileError::read(path))?.len();
        if size == 0 {
            return Err(FileError::content(path, "a WAV file", "an empty file"));
        }
        let unreadable = |source| FileError::unreadable(path, "WAV file", source);
        let chunks = Chunks::read(&mut BufReader::new(&file)).map_err(unreadable)?;
        let bytes = chunks.samples.end - chunks.samples.start;
        if chunks.samples.end > size {
            return Err(FileError::content(
                path,
                format!("{bytes} bytes of samples, as its header says"),
                format!("a file of {size} bytes, cut short"),
            ));
        }
        let Some(header) = chunks.header() else {
            return Err(FileError::content(path, "less than 4 GiB of samples", format!("{bytes} bytes")));
        };
        file.seek(SeekFrom::Start(chunks.samples.start)).map_err(FileError::read(path))?;
        let inner = hound::WavReader::new(BufReader::new(Cursor::new(header).chain(file.take(bytes)))).map_err(unreadable)?;
        let spec = inner.spec();
        if spec.channels == 0 {
            return Err(FileError::content(path, "at least one channel", "none"));
        }
        check_rate(path, spec.sample_rate)?;
        if inner.len() == 0 {
            return Err(FileError::content(path, "at least one sample", "none"));
        }
        Ok(Self { inner, path: path.to_path_buf(), position: 0 })
    }

    /// Number of channels, at least 1.
    #[must_use]
    pub fn channels(&self) -> u16 {
        self.inner.spec().channels
    }

    /// Samples per second.
    #[must_use]
    pub fn sample_rate_hz(&self) -> u32 {
        self.inner.spec().sample_rate
    }

    /// Samples per channel in the whole file.
    #[must_use]
    pub fn frames(&self) -> u32 {
        self.inner.duration()
    }

    /// Appends up to `frames` samples to each of `channels`; returns how many, 0 at the end.
    ///
    /// # Errors
    /// A file that ends early or a sample that is not finite.
    ///
    /// # Panics
    /// When `channels` has another length than [`WavReader::channels`].
    pub fn read(&mut self, frames: usize, channels: &mut [Vec<f32>]) -> Result<usize, FileError> {
        assert_eq!(channels.len(), usize::from(self.channels()), "one buffer per channel");
        let count = frames.min((self.frames() - self.position) as usize);
        channels.iter_mut().for_each(|c| c.reserve(count));
        let spec = self.inner.spec();
        match spec.sample_format {
            SampleFormat::Float => self.append(count, channels, |v: f32| v),
            SampleFormat::Int => {
                let scale = 0.5_f64.powi(i32::from(spec.bits_per_sample) - 1);
                self.append(count, channels, |v: i32| narrow(f64::from(v) * scale))
            }
        }
    }

    fn append<S: hound::Sample>(
        &mut self,
        count: usize,
        channels: &mut [Vec<f32>],
        convert: impl Fn(S) -> f32,
    ) -> Result<usize, FileError> {
        let mut samples = self.inner.samples::<S>();
        for frame in 0..count {
            for (number, channel) in channels.iter_mut().enumerate() {
                let at = u64::from(self.position) + frame as u64;
                let ended = || {
                    FileError::entry(&self.path, format!("sample {at}"), "a sample, as its header says", "the end of the file")
                };
                let sample = samples.next().ok_or_else(ended)?.map_err(|source| match source {
                    hound::Error::IoError(_) => ended(),
                    source => FileError::unreadable(&self.path, "WAV file", source),
                })?;
                let value = convert(sample);
                if !value.is_finite() {
                    return Err(FileError::entry(
                        &self.path,
                        format!("sample {at} of channel {number}"),
                        "a finite number",
                        format!("{value}"),
                    ));
                }
                channel.push(value);
            }
        }
        self.position += u32::try_from(count).unwrap_or(u32::MAX);
        Ok(count)
    }
}

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
    /// No channel, a rate outside [`SAMPLE_RATES_HZ`], or a place that cannot be written to.
    pub fn create(path: &Path, sample_rate_hz: u32, channels: u16, format: Format) -> Result<Self, FileError> {
        if channels == 0 {
            return Err(FileError::content(path, "at least one channel", "none"));
        }
        check_rate(path, sample_rate_hz)?;
        let (draft, file) = Draft::create(path)?;
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

/// Writes a whole WAV file; `channels` are slices of the same length.
///
/// # Errors
/// A target that cannot be written, more channels or samples than a WAV file holds, a sample that is not finite.
pub fn write(path: &Path, sample_rate_hz: u32, channels: &[&[f32]], format: Format) -> Result<Written, FileError> {
    let count = u16::try_from(channels.len())
        .map_err(|_| FileError::content(path, "at most 65535 channels", format!("{}", channels.len())))?;
    let mut writer = WavWriter::create(path, sample_rate_hz, count, format)?;
    writer.write(channels)?;
    writer.finish()
}
