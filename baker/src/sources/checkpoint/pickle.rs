//! How much a bare pickle asks for, before it is parsed: every operation may make an object of some 90 bytes.

use crate::BakeError;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

/// Operations that are let through; a published checkpoint has some 30 thousand.
const MAX_OPERATIONS: usize = 1 << 20;
/// PyTorch before 1.6 wrote this many pickles, then the arrays: magic number, version, system, content, names of the arrays.
const PICKLES: usize = 5;

/// Refuses a file whose pickles have more operations than a checkpoint would.
pub(super) fn check(path: &Path) -> Result<(), BakeError> {
    let file = File::open(path).map_err(BakeError::read(path))?;
    match walk(&mut BufReader::new(file), PICKLES) {
        Ok(()) => Ok(()),
        // Where the file ends too early the parser will end as well.
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => Ok(()),
        Err(source) => Err(BakeError::unreadable(path, "PyTorch checkpoint", source)),
    }
}

/// Steps over operations and their operands (Python's pickletools lists them).
fn walk(r: &mut impl BufRead, pickles: usize) -> std::io::Result<()> {
    let invalid = |what: String| std::io::Error::new(ErrorKind::InvalidData, what);
    let mut ended = 0;
    for _ in 0..MAX_OPERATIONS {
        let [operation] = bytes(r)?;
        let operand = match operation {
            b'.' => {
                ended += 1;
                if ended == pickles {
                    return Ok(());
                }
                0
            }
            b'(' | b')' | b'0' | b'1' | b'2' | b'N' | b'Q' | b'R' | b']' | b'}' => 0,
            b'a' | b'b' | b'd' | b'e' | b'l' | b'o' | b's' | b't' | b'u' => 0,
            0x81 | 0x85..=0x89 | 0x8f..=0x94 | 0x97 | 0x98 => 0,
            b'K' | b'h' | b'q' | 0x80 | 0x82 => 1,
            b'M' | 0x83 => 2,
            b'J' | b'j' | b'r' | 0x84 => 4,
            b'G' | 0x95 => 8,
            b'U' | b'C' | 0x8a | 0x8c => u64::from(u8::from_le_bytes(bytes(r)?)),
            b'T' | b'X' | b'B' | 0x8b => u64::from(u32::from_le_bytes(bytes(r)?)),
            0x8d | 0x8e | 0x96 => u64::from_le_bytes(bytes(r)?),
            b'F' | b'I' | b'L' | b'P' | b'S' | b'V' | b'g' | b'p' => {
                r.skip_until(b'\n')?;
                0
            }
            b'c' | b'i' => {
                r.skip_until(b'\n')?;
                r.skip_until(b'\n')?;
                0
            }
            other => return Err(invalid(format!("{other:#04x} is no operation of a pickle"))),
        };
        if std::io::copy(&mut r.take(operand), &mut std::io::sink())? < operand {
            return Err(ErrorKind::UnexpectedEof.into());
        }
    }
    Err(invalid(format!("its pickle has more than {MAX_OPERATIONS} operations")))
}

fn bytes<const N: usize>(r: &mut impl Read) -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    r.read_exact(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operands_are_not_taken_for_operations() {
        // Each operand holds an end; only the last byte is one.
        let pickles: [&[u8]; 9] = [
            b"\x80\x02.",
            b"K..",
            b"M...",
            b"J.....",
            b"G.........",
            b"U\x02...",
            b"X\x01\x00\x00\x00..",
            b"\x8d\x01\0\0\0\0\0\0\0..",
            b"c.\n.\n.",
        ];
        for pickle in pickles {
            let mut rest = &[pickle, b"\xff"].concat()[..];
            walk(&mut rest, 1).unwrap_or_else(|e| panic!("{pickle:?}: {e}"));
            assert_eq!(rest, b"\xff", "{pickle:?}");
        }
    }

    #[test]
    fn what_asks_for_too_much_is_refused() {
        let much = vec![b'N'; MAX_OPERATIONS + 1];
        assert!(walk(&mut &much[..], 1).unwrap_err().to_string().contains("operations"));
        assert_eq!(walk(&mut &much[..9], 1).unwrap_err().kind(), ErrorKind::UnexpectedEof);
        assert_eq!(walk(&mut &b"X\xff\xff\xff\xffab."[..], 1).unwrap_err().kind(), ErrorKind::UnexpectedEof);
        assert!(walk(&mut &b"\xff"[..], 1).unwrap_err().to_string().contains("0xff"));
    }
}
