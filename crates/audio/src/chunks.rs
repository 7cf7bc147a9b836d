//! The chunks of a WAV file: RIFF, and RF64 or BW64 (EBU Tech 3306, ITU-R BS.2088), whose sizes have 64 bits.

use hound::{Error, Result};
use std::io::{BufRead, Seek, SeekFrom};
use std::ops::Range;

/// Chunks before the samples; a file has some ten.
const MAX_CHUNKS: usize = 1000;
/// Bytes of a format chunk that states what its samples mean by an identifier of 16 bytes, and of one that does not.
const EXTENSIBLE_BYTES: usize = 40;
const PLAIN_BYTES: usize = 16;

/// Where the samples of a WAV file are, and their format.
pub(crate) struct Chunks {
    format: Vec<u8>,
    /// Bytes of the samples within the file, as its header states them.
    pub(crate) samples: Range<u64>,
}

impl Chunks {
    /// Reads the headers of a file from its start up to the samples.
    pub(crate) fn read(file: &mut (impl BufRead + Seek)) -> Result<Self> {
        let wrong = |what| Err(Error::FormatError(what));
        let [form, _, kind] = read::<12>(file)?.as_chunks::<4>().0.try_into().unwrap_or_default();
        let has_long_sizes = matches!(&form, b"RF64" | b"BW64");
        if !has_long_sizes && &form != b"RIFF" {
            return wrong("expected RIFF, RF64 or BW64 at its start");
        }
        if &kind != b"WAVE" {
            return wrong("no WAVE tag found");
        }
        let (mut format, mut long_size) = (None, None);
        let mut at = 12_u64;
        for _ in 0..MAX_CHUNKS {
            let [id, size] = read::<8>(file)?.as_chunks::<4>().0.try_into().unwrap_or_default();
            let size = u32::from_le_bytes(size);
            at += 8;
            match &id {
                b"ds64" if has_long_sizes => {
                    let [_, samples] = read::<16>(file)?.as_chunks::<8>().0.try_into().unwrap_or_default();
                    long_size = Some(u64::from_le_bytes(samples));
                }
                b"fmt " => format = Some(plain_format(file, size)?),
                b"data" => {
                    let size = if has_long_sizes && size == u32::MAX { long_size } else { Some(u64::from(size)) };
                    return match (format, size) {
                        (Some(format), Some(size)) => Ok(Self { format, samples: at..at.saturating_add(size) }),
                        (None, _) => wrong("no format before the samples"),
                        (_, None) => wrong("no ds64 chunk before the samples"),
                    };
                }
                _ => (),
            }
            at += u64::from(size);
            file.seek(SeekFrom::Start(at))?;
            // Chunks begin at even places; some writers forget that, and no name begins with a zero.
            if size % 2 == 1 && file.fill_buf()?.first() == Some(&0) {
                file.consume(1);
                at += 1;
            }
        }
        wrong("too many chunks before the samples")
    }

    /// A header of 32-bit sizes with nothing but the format, to put before the samples; none for 4 GiB or more.
    pub(crate) fn header(&self) -> Option<Vec<u8>> {
        let samples = u32::try_from(self.samples.end - self.samples.start).ok()?;
        let format = u32::try_from(self.format.len()).ok()?;
        let mut bytes = b"RIFF".to_vec();
        bytes.extend(samples.checked_add(20 + format)?.to_le_bytes());
        bytes.extend(b"WAVEfmt ");
        bytes.extend(format.to_le_bytes());
        bytes.extend(&self.format);
        bytes.extend(b"data");
        bytes.extend(samples.to_le_bytes());
        Some(bytes)
    }
}

/// A format chunk without what no format of integers or floats needs.
fn plain_format(file: &mut impl BufRead, size: u32) -> Result<Vec<u8>> {
    const EXTENSIBLE: u16 = 0xFFFE;
    let mut format = vec![0; EXTENSIBLE_BYTES.min(size as usize)];
    file.read_exact(&mut format)?;
    let field = |at: usize| format.get(at..at + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
    let (channels, frame_bytes, bits) = (field(2), field(12), field(14));
    if u32::from(frame_bytes) != u32::from(channels) * u32::from(bits.div_ceil(8)) {
        return Err(Error::FormatError("its samples have another size than their containers"));
    }
    if field(0) == EXTENSIBLE && format.len() == EXTENSIBLE_BYTES {
        // Of a sample with fewer bits than its container the upper ones count, so that the container is read as a whole: the
        // size of the extension stays, and the number of valid bits is left open.
        format[16..20].copy_from_slice(&[22, 0, 0, 0]);
    } else {
        format.truncate(PLAIN_BYTES);
    }
    Ok(format)
}

fn read<const N: usize>(file: &mut impl BufRead) -> Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
