//! What a checkpoint's pickle asks for, before it is parsed: every operation may make an object of some 90 bytes, and every
//! storage has a length that its bytes must have.

use crate::BakeError;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

/// Operations that are let through; a published checkpoint has some 30 thousand.
const MAX_OPERATIONS: usize = 1 << 20;
/// PyTorch before 1.6 wrote this many pickles, then the arrays: magic number, version, system, content, names of the arrays.
const PICKLES: usize = 5;
/// Bytes of an operand that are looked at; names of storages are shorter.
const MOST_SEEN: u64 = 256;

/// Refuses a file whose pickles have more operations than a checkpoint would.
pub(super) fn check(path: &Path) -> Result<(), BakeError> {
    let file = File::open(path).map_err(BakeError::read(path))?;
    match walk(&mut BufReader::new(file), PICKLES, &mut |_, _| {}) {
        Ok(()) => Ok(()),
        // Where the file ends too early the parser will end as well.
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => Ok(()),
        Err(source) => Err(BakeError::unreadable(path, "PyTorch checkpoint", source)),
    }
}

/// Bytes of the storages that an archive's pickle declares, by key. What is wrong with the pickle is left for the parser to
/// find.
pub(super) fn storages(mut pickle: &[u8]) -> BTreeMap<String, u64> {
    let mut storages = Storages::default();
    let _ = walk(&mut pickle, 1, &mut |operation, operand| storages.operation(operation, operand));
    storages.bytes
}

/// A value that declares a part of a storage.
#[derive(Clone, Debug)]
enum Value {
    Text(String),
    Number(u64),
    Other,
}

/// The persistent identifiers in a pickle: tuples ("storage", class, key, device, number of elements).
#[derive(Default)]
struct Storages {
    bytes: BTreeMap<String, u64>,
    /// Values since the last mark, and those of the last tuple.
    items: Vec<Value>,
    tuple: Vec<Value>,
    memo: BTreeMap<u64, Value>,
}

impl Storages {
    fn operation(&mut self, operation: u8, operand: &[u8]) {
        let number = || operand.iter().rev().fold(0_u64, |n, b| (n << 8) | u64::from(*b));
        let last = |items: &[Value]| items.last().cloned().unwrap_or(Value::Other);
        match operation {
            b'(' => self.items.clear(),
            b't' => self.tuple = std::mem::take(&mut self.items),
            b'Q' => self.declare(),
            b'X' | b'U' | 0x8c => self.items.push(Value::Text(String::from_utf8_lossy(operand).into_owned())),
            b'c' => {
                let name = operand.split(|b| *b == b'\n').nth(1).unwrap_or_default();
                self.items.push(Value::Text(String::from_utf8_lossy(name).into_owned()));
            }
            // Module and name lie on the stack.
            0x93 => {
                let name = self.items.pop().unwrap_or(Value::Other);
                self.items.pop();
                self.items.push(name);
            }
            b'K' | b'M' | b'J' | 0x8a => self.items.push(Value::Number(number())),
            b'q' | b'r' => {
                self.memo.insert(number(), last(&self.items));
            }
            0x94 => {
                self.memo.insert(self.memo.len() as u64, last(&self.items));
            }
            b'h' | b'j' => self.items.push(self.memo.get(&number()).cloned().unwrap_or(Value::Other)),
            _ => {}
        }
    }

    fn declare(&mut self) {
        let [Value::Text(kind), Value::Text(class), Value::Text(key), _, Value::Number(count)] = &self.tuple[..] else {
            return;
        };
        let size = match class.as_str() {
            "DoubleStorage" | "LongStorage" => 8,
            "FloatStorage" | "IntStorage" => 4,
            "HalfStorage" | "BFloat16Storage" | "ShortStorage" => 2,
            "CharStorage" | "ByteStorage" | "BoolStorage" | "UntypedStorage" => 1,
            _ => return,
        };
        if kind == "storage" {
            self.bytes.insert(key.clone(), count.saturating_mul(size));
        }
    }
}

/// Steps over operations and their operands (Python's pickletools lists them); `visit` sees each with the start of its operand.
fn walk(r: &mut impl BufRead, pickles: usize, visit: &mut impl FnMut(u8, &[u8])) -> std::io::Result<()> {
    let invalid = |what: String| std::io::Error::new(ErrorKind::InvalidData, what);
    let mut ended = 0;
    let mut kept = Vec::new();
    for _ in 0..MAX_OPERATIONS {
        let [operation] = bytes(r)?;
        kept.clear();
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
                line(r, &mut kept)?;
                line(r, &mut kept)?;
                0
            }
            other => return Err(invalid(format!("{other:#04x} is no operation of a pickle"))),
        };
        if operand > 0 {
            let read = r.take(operand.min(MOST_SEEN)).read_to_end(&mut kept)? as u64;
            if read + std::io::copy(&mut r.take(operand - read), &mut std::io::sink())? < operand {
                return Err(ErrorKind::UnexpectedEof.into());
            }
        }
        visit(operation, &kept);
    }
    Err(invalid(format!("its pickle has more than {MAX_OPERATIONS} operations")))
}

/// Steps over a line, of which the start is kept.
fn line(r: &mut impl BufRead, kept: &mut Vec<u8>) -> std::io::Result<()> {
    r.take(MOST_SEEN).read_until(b'\n', kept)?;
    if kept.last() != Some(&b'\n') {
        r.skip_until(b'\n')?;
    }
    Ok(())
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
            walk(&mut rest, 1, &mut |_, _| {}).unwrap_or_else(|e| panic!("{pickle:?}: {e}"));
            assert_eq!(rest, b"\xff", "{pickle:?}");
        }
    }

    #[test]
    fn what_asks_for_too_much_is_refused() {
        let much = vec![b'N'; MAX_OPERATIONS + 1];
        let walk = |mut pickle: &[u8]| walk(&mut pickle, 1, &mut |_, _| {}).unwrap_err();
        assert!(walk(&much).to_string().contains("operations"));
        assert_eq!(walk(&much[..9]).kind(), ErrorKind::UnexpectedEof);
        assert_eq!(walk(b"X\xff\xff\xff\xffab.").kind(), ErrorKind::UnexpectedEof);
        assert!(walk(b"\xff").to_string().contains("0xff"));
    }
}
