//! Arrays of floats in NumPy's .npy (numpy.lib.format, versions 1 to 3).

use crate::{FileError, file};
use half::f16;
use std::path::Path;

/// Numbers in rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Lengths of its dimensions, the slowest first.
    pub shape: Vec<usize>,
    /// As many numbers as the product of the lengths, the last index fastest.
    pub values: Vec<f64>,
}

/// Makes numbers of bytes.
type Values = fn(&[u8]) -> Vec<f64>;

impl Array {
    /// Reads a regular file of at most `most` bytes.
    ///
    /// # Errors
    /// A file that is missing, longer, damaged, or has other elements than little-endian floats of 16, 32 or 64 bits.
    pub fn read(path: &Path, most: u64) -> Result<Self, FileError> {
        let bytes = file::read(path, most).map_err(FileError::read(path))?;
        Self::from_bytes(&bytes).map_err(|found| FileError::content(path, "rows of floats as NumPy saves them", found))
    }

    /// Reads the content of a file.
    ///
    /// # Errors
    /// What is wrong with it: a damaged header, other elements than little-endian floats, a shape that its bytes do not have.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let damaged = || "a damaged header".to_owned();
        let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or_else(damaged)?;
        let (len, rest) = match rest {
            [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
            [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
            _ => return Err(damaged()),
        };
        let (header, data) = rest.split_at_checked(len).ok_or_else(damaged)?;
        let header = std::str::from_utf8(header).map_err(|_| damaged())?;
        // The header is a Python dictionary of which NumPy writes exactly these three entries.
        let entry =
            |key: &str| header.split_once(&format!("'{key}':")).map(|(_, value)| value.trim_start()).ok_or_else(damaged);
        let (size, values): (_, Values) = match entry("descr")?.strip_prefix('\'').and_then(|d| d.split_once('\'')) {
            Some(("<f8", _)) => (8, |data| data.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()),
            Some(("<f4", _)) => (4, |data| data.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b).into()).collect()),
            Some(("<f2", _)) => (2, |data| data.as_chunks().0.iter().map(|b| f16::from_le_bytes(*b).into()).collect()),
            Some((other, _)) => return Err(format!("elements of type '{other}'")),
            None => return Err("elements of a compound type".to_owned()),
        };
        let by_columns = entry("fortran_order")?.starts_with("True");
        let sizes = entry("shape")?.strip_prefix('(').and_then(|s| s.split_once(')')).ok_or_else(damaged)?.0;
        let sizes = sizes.split(',').map(str::trim).filter(|s| !s.is_empty());
        let shape: Vec<usize> = sizes.map(str::parse).collect::<Result<_, _>>().map_err(|_| damaged())?;
        if shape.iter().try_fold(size, |n: usize, s| n.checked_mul(*s)) != Some(data.len()) {
            return Err(format!("the shape {shape:?} with {} bytes", data.len()));
        }
        let values = values(data);
        match shape[..] {
            [rows, columns] if by_columns => {
                let values = (0..rows).flat_map(|r| (0..columns).map(move |c| c * rows + r)).map(|i| values[i]).collect();
                Ok(Self { shape, values })
            }
            [_, _, _, ..] if by_columns => Err(format!("the shape {shape:?} with the first index fastest")),
            _ => Ok(Self { shape, values }),
        }
    }
}
