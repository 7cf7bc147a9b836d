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

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let len = u16::try_from(header.len()).unwrap().to_le_bytes();
        [b"\x93NUMPY\x01\x00".as_slice(), &len, header.as_bytes(), data].concat()
    }

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn rows_and_columns_keep_their_places() {
        let data = floats(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let by_rows = Array::from_bytes(&npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }\n", &data)).unwrap();
        assert_eq!((by_rows.shape, by_rows.values), (vec![2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
        let by_columns =
            Array::from_bytes(&npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }\n", &data)).unwrap();
        assert_eq!((by_columns.shape, by_columns.values), (vec![2, 3], vec![0.0, 2.0, 4.0, 1.0, 3.0, 5.0]));
    }

    #[test]
    fn wrong_arrays_are_errors() {
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }\n";
        let good = npy(header, &floats(&[1.0, 2.0]));
        assert!(Array::from_bytes(&good).is_ok());
        for len in 0..good.len() {
            assert!(Array::from_bytes(&good[..len]).is_err(), "cut to {len} bytes");
        }
        for (from, to, says) in [
            ("<f4", "<i4", "'<i4'"),
            ("<f4", ">f4", "'>f4'"),
            ("(2,)", "(18446744073709551615, 4)", "18446744073709551615"),
            ("(2,)", "(3,)", "[3] with 8 bytes"),
            ("(2,)", "(-2,)", "header"),
            ("'<f4'", "[('x', '<f4')]", "compound"),
        ] {
            let found = Array::from_bytes(&npy(&header.replace(from, to), &floats(&[1.0, 2.0]))).unwrap_err();
            assert!(found.contains(says), "{to}: {found}");
        }
    }
}
