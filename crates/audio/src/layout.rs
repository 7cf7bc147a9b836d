//! Where a file's samples are, and how each is stored: WAV as RIFF, and as RF64 or BW64, whose sizes have 64 bits (EBU Tech
//! 3306, ITU-R BS.2088); AIFF and AIFF-C (Apple, "Audio Interchange File Format", 1989 and 1991).

use crate::narrow;
use std::io::{BufRead, Error, ErrorKind, Result, Seek, SeekFrom};
use std::ops::Range;

/// Chunks before the samples; a file has some ten.
const MAX_CHUNKS: usize = 1000;
/// Sizes from here on stand for "not known yet" where a file is shorter: writers into pipes cannot come back (ffmpeg writes
/// 0xFFFFFFFF, SoX 0x7FFFF000 and less a header).
const OPEN_SIZE: u64 = 0x7FFF_0000;

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Encoding {
    kind: Kind,
    /// Bytes of a sample: 1 to 4 of integers, 4 or 8 of floats.
    pub(crate) bytes: usize,
    big_endian: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Unsigned,
    Signed,
    Float,
}

impl Encoding {
    fn of(kind: Kind, bytes: usize, big_endian: bool) -> Result<Self> {
        match (kind, bytes) {
            (Kind::Float, 4 | 8) | (Kind::Signed, 1..=4) | (Kind::Unsigned, 1) => Ok(Self { kind, bytes, big_endian }),
            _ => wrong(format!("samples of {} bits", 8 * bytes)),
        }
    }

    /// A sample of its bytes, full scale 1.
    pub(crate) fn value(self, stored: &[u8]) -> f32 {
        // The most significant byte comes first here.
        let mut top = [0_u8; 8];
        for (i, to) in top[..self.bytes].iter_mut().enumerate() {
            *to = stored[if self.big_endian { i } else { self.bytes - 1 - i }];
        }
        let [a, b, c, d, ..] = top;
        match (self.kind, self.bytes) {
            (Kind::Float, 4) => f32::from_be_bytes([a, b, c, d]),
            (Kind::Float, _) => narrow(f64::from_be_bytes(top)),
            (Kind::Unsigned, _) => (f32::from(a) - 128.0) / 128.0,
            (Kind::Signed, _) => narrow(f64::from(i32::from_be_bytes([a, b, c, d])) * 0.5_f64.powi(31)),
        }
    }
}

/// A file's header.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) channels: u16,
    pub(crate) sample_rate_hz: u32,
    pub(crate) encoding: Encoding,
    /// Bytes of the samples within the file.
    pub(crate) samples: Range<u64>,
}

fn wrong<T>(what: impl Into<String>) -> Result<T> {
    Err(Error::new(ErrorKind::InvalidData, what.into()))
}

impl Layout {
    /// Reads the headers of a file of `size` bytes from its start up to the samples.
    pub(crate) fn read(file: &mut (impl BufRead + Seek), size: u64) -> Result<Self> {
        let [form, _, kind] = read::<12>(file)?.as_chunks::<4>().0.try_into().unwrap_or_default();
        match (&form, &kind) {
            (b"RIFF" | b"RF64" | b"BW64", b"WAVE") => Self::of_wav(file, size, &form != b"RIFF"),
            (b"RIFF" | b"RF64" | b"BW64", _) => wrong("no WAVE tag found"),
            (b"FORM", b"AIFF" | b"AIFC") => Self::of_aiff(file),
            _ => wrong("expected RIFF, RF64, BW64 or FORM at its start"),
        }
    }

    fn of_wav(file: &mut (impl BufRead + Seek), size: u64, has_long_sizes: bool) -> Result<Self> {
        let (mut format, mut long_size) = (None, None);
        let mut chunks = Walk::new(false);
        while let Some((id, bytes)) = chunks.next(file)? {
            match &id {
                b"ds64" if has_long_sizes => {
                    let [_, samples] = read::<16>(file)?.as_chunks::<8>().0.try_into().unwrap_or_default();
                    long_size = Some(u64::from_le_bytes(samples));
                }
                b"fmt " => format = Some(Format::read(file, bytes)?),
                b"data" => {
                    let Some(Format { channels, sample_rate_hz, encoding }) = format else {
                        return wrong("no format before the samples");
                    };
                    let (start, held) = (chunks.at, size.saturating_sub(chunks.at));
                    let frame = u64::from(channels) * encoding.bytes as u64;
                    let stated = match long_size {
                        Some(long) if bytes == u64::from(u32::MAX) => long,
                        None if has_long_sizes && bytes == u64::from(u32::MAX) => {
                            return wrong("no ds64 chunk before the samples");
                        }
                        // Nobody came back to write the size: a pipe, or a recorder that was stopped.
                        _ if (bytes >= OPEN_SIZE && bytes > held) || (bytes == 0 && !is_chunk(file, held)?) => {
                            held - held % frame.max(1)
                        }
                        _ => bytes,
                    };
                    return Ok(Self { channels, sample_rate_hz, encoding, samples: start..start.saturating_add(stated) });
                }
                _ => (),
            }
        }
        wrong("too many chunks before the samples")
    }

    fn of_aiff(file: &mut (impl BufRead + Seek)) -> Result<Self> {
        let mut format = None;
        let mut chunks = Walk::new(true);
        while let Some((id, bytes)) = chunks.next(file)? {
            match &id {
                b"COMM" => {
                    let common = read::<18>(file)?;
                    let compression = if bytes >= 22 { read::<4>(file)? } else { *b"NONE" };
                    let [channels, bits] = [0, 6].map(|at| u16::from_be_bytes([common[at], common[at + 1]]));
                    let frames = u32::from_be_bytes([common[2], common[3], common[4], common[5]]);
                    let bytes = usize::from(bits.div_ceil(8));
                    let encoding = match &compression {
                        b"NONE" | b"twos" | b"in24" | b"in32" => Encoding::of(Kind::Signed, bytes, true)?,
                        b"sowt" => Encoding::of(Kind::Signed, bytes, false)?,
                        b"raw " => Encoding::of(Kind::Unsigned, bytes, true)?,
                        b"fl32" | b"FL32" => Encoding::of(Kind::Float, 4, true)?,
                        b"fl64" | b"FL64" => Encoding::of(Kind::Float, 8, true)?,
                        other => return wrong(format!("samples compressed as {}", String::from_utf8_lossy(other))),
                    };
                    format = Some((channels, extended(&common[8..]), frames, encoding));
                }
                b"SSND" => {
                    let Some((channels, sample_rate_hz, frames, encoding)) = format else {
                        return wrong("no format before the samples");
                    };
                    let [a, b, c, d, ..] = read::<8>(file)?;
                    let start = chunks.at + 8 + u64::from(u32::from_be_bytes([a, b, c, d]));
                    let bytes = u64::from(frames) * u64::from(channels) * encoding.bytes as u64;
                    return Ok(Self { channels, sample_rate_hz, encoding, samples: start..start + bytes });
                }
                _ => (),
            }
        }
        wrong("too many chunks before the samples")
    }
}

/// What a WAV file's format chunk says.
struct Format {
    channels: u16,
    sample_rate_hz: u32,
    encoding: Encoding,
}

impl Format {
    fn read(file: &mut impl BufRead, size: u64) -> Result<Self> {
        const EXTENSIBLE: u16 = 0xFFFE;
        let plain = read::<16>(file)?;
        let field = |at: usize| u16::from_le_bytes([plain[at], plain[at + 1]]);
        let (channels, frame_bytes, bits) = (field(2), field(12), field(14));
        if u32::from(frame_bytes) != u32::from(channels) * u32::from(bits.div_ceil(8)) {
            return wrong("its samples have another size than their containers");
        }
        // Of a sample with fewer bits than its container the upper ones count, so that the container is read as a whole.
        let tag = if field(0) == EXTENSIBLE && size >= 40 {
            let [.., low, high] = read::<10>(file)?;
            u16::from_le_bytes([low, high])
        } else {
            field(0)
        };
        let kind = match (tag, bits) {
            (1, ..=8) => Kind::Unsigned,
            (1, _) => Kind::Signed,
            (3, _) => Kind::Float,
            _ => return wrong(format!("samples that are neither integers nor floats, format {tag}")),
        };
        let encoding = Encoding::of(kind, usize::from(bits.div_ceil(8)), false)?;
        let sample_rate_hz = u32::from_le_bytes([plain[4], plain[5], plain[6], plain[7]]);
        Ok(Self { channels, sample_rate_hz, encoding })
    }
}

/// Chunk by chunk through a file.
struct Walk {
    big_endian: bool,
    count: usize,
    /// Where the present chunk's content begins, and its size.
    at: u64,
    size: u64,
}

impl Walk {
    fn new(big_endian: bool) -> Self {
        Self { big_endian, count: 0, at: 12, size: 0 }
    }

    /// The next chunk's name and size, bytes; none after a thousand.
    fn next(&mut self, file: &mut (impl BufRead + Seek)) -> Result<Option<([u8; 4], u64)>> {
        self.at += self.size;
        file.seek(SeekFrom::Start(self.at))?;
        // Chunks begin at even places; some writers forget that, and no name begins with a zero.
        if self.size % 2 == 1 && file.fill_buf()?.first() == Some(&0) {
            file.consume(1);
            self.at += 1;
        }
        let [id, size] = read::<8>(file)?.as_chunks::<4>().0.try_into().unwrap_or_default();
        self.at += 8;
        self.size = u64::from(if self.big_endian { u32::from_be_bytes(size) } else { u32::from_le_bytes(size) });
        self.count += 1;
        Ok((self.count <= MAX_CHUNKS).then_some((id, self.size)))
    }
}

/// Whether what follows, all `held` bytes of it, is one more chunk, or nothing at all.
fn is_chunk(file: &mut impl BufRead, held: u64) -> Result<bool> {
    let Some((id, rest)) = file.fill_buf()?.split_first_chunk::<4>() else { return Ok(true) };
    let size = rest.first_chunk::<4>().map(|size| u64::from(u32::from_le_bytes(*size)));
    Ok(id.iter().all(|c| c.is_ascii_graphic() || *c == b' ') && size.is_some_and(|size| size + 8 <= held))
}

/// A whole number of hertz of a float of 80 bits; 0 where it is none of 32 bits.
fn extended(bytes: &[u8]) -> u32 {
    let exponent = i32::from(u16::from_be_bytes([bytes[0] & 0x7F, bytes[1]])) - 16_383;
    let mantissa = bytes[2..10].iter().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
    match 63 - exponent {
        shift @ 32..=63 => u32::try_from(mantissa >> shift).unwrap_or(0),
        _ => 0,
    }
}

fn read<const N: usize>(file: &mut impl BufRead) -> Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
