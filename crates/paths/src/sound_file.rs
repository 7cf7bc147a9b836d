//! Sound files by their chunks, of which a path is in one and the rest may be any length.

use crate::limit::MAX_FILE_BYTES;
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};

/// Chunks of a file at most.
const MOST_CHUNKS: usize = 1_000;
/// Bytes that tell a sound file.
const HEAD: usize = 12;

/// Whether a file is a WAV file or one of its kin.
pub(crate) fn is_wave(bytes: &[u8]) -> bool {
    [&b"RIFF"[..], b"RF64", b"BW64"].iter().any(|id| bytes.starts_with(id)) && bytes.get(8..12) == Some(b"WAVE")
}

/// What [`crate::read()`] needs of a file: all of it, up to [`MAX_FILE_BYTES`], but of a sound file, which may be longer, the
/// chunk `axml` alone behind the file's head. Samples are passed over.
///
/// # Errors
/// A file that cannot be read or is too long.
pub fn bytes_of(file: &mut (impl Read + Seek)) -> Result<Vec<u8>> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(0))?;
    let mut bytes = Vec::new();
    file.by_ref().take(HEAD as u64).read_to_end(&mut bytes)?;
    if !is_wave(&bytes) {
        return all(file, length, bytes);
    }
    match axml(file)? {
        Some(chunk) => {
            bytes.extend(chunk);
            Ok(bytes)
        }
        // It is short, or the error is said where the bytes are read.
        None => {
            file.seek(SeekFrom::Start(0))?;
            all(&mut file.by_ref().take(MAX_FILE_BYTES.min(length).min(1 << 16)), 0, Vec::new())
        }
    }
}

fn all(file: &mut impl Read, length: u64, mut bytes: Vec<u8>) -> Result<Vec<u8>> {
    let too_long =
        |found: String| Error::new(ErrorKind::FileTooLarge, format!("expected at most {MAX_FILE_BYTES} bytes, found {found}"));
    if length > MAX_FILE_BYTES {
        return Err(too_long(length.to_string()));
    }
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES { Err(too_long("more".to_owned())) } else { Ok(bytes) }
}

/// The chunk `axml` with its head, if the file has a whole one. Chunks of 4 GiB and more have their length in the chunk `ds64`.
fn axml(file: &mut (impl Read + Seek)) -> Result<Option<Vec<u8>>> {
    let mut at = HEAD as u64;
    let mut data = None;
    for _ in 0..MOST_CHUNKS {
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0; 8];
        if file.read_exact(&mut head).is_err() {
            return Ok(None);
        }
        let [id, length] = [[head[0], head[1], head[2], head[3]], [head[4], head[5], head[6], head[7]]];
        let mut length = u64::from(u32::from_le_bytes(length));
        match &id {
            b"ds64" => {
                let mut sizes = [0; 16];
                if file.read_exact(&mut sizes).is_ok() {
                    data = sizes.as_chunks::<8>().0.last().map(|size| u64::from_le_bytes(*size));
                }
            }
            b"data" if length == u64::from(u32::MAX) => length = data.unwrap_or(length),
            b"axml" => {
                let mut chunk = head.to_vec();
                file.take(length).read_to_end(&mut chunk)?;
                return Ok((chunk.len() as u64 == 8 + length).then_some(chunk));
            }
            _ => (),
        }
        // Chunks begin at even bytes.
        let Some(next) = at.checked_add(8).and_then(|at| at.checked_add(length)).and_then(|at| at.checked_next_multiple_of(2))
        else {
            return Ok(None);
        };
        at = next;
    }
    Ok(None)
}
