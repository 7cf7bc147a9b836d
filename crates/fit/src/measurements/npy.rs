//! Arrays of NumPy, format 1 to 3: numbers of one kind, rows first.

use crate::error::FitError;
use promenade_audio::{FileError, file};
use std::io::Read;
use std::path::Path;

/// Bytes of an array, at most.
const MAX_BYTES: u64 = 4 << 30;

/// An array and its shape.
pub(super) struct Array {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f64>,
}

/// Reads `f4` and `f8`, little-endian.
pub(super) fn read(path: &Path) -> Result<Array, FitError> {
    let mut bytes = Vec::new();
    let opened = file::open(path).and_then(|f| f.take(MAX_BYTES).read_to_end(&mut bytes));
    opened.map_err(FileError::read(path))?;
    let wrong = |expected: &str, found: String| FitError::content(path, expected, found);
    let (&[major], Some(b"\x93NUMPY")) = (bytes.get(6..7).unwrap_or(&[0]), bytes.get(..6)) else {
        return Err(wrong("a NumPy array", format!("{} bytes of something else", bytes.len())));
    };
    let (start, length): (usize, usize) = match (major, bytes.get(8..12)) {
        (1, Some(l)) => (10, usize::from(u16::from_le_bytes([l[0], l[1]]))),
        (2 | 3, Some(l)) => (12, u32::from_le_bytes([l[0], l[1], l[2], l[3]]) as usize),
        _ => return Err(wrong("format 1 to 3 of NumPy arrays", major.to_string())),
    };
    let header = bytes.get(start..start.saturating_add(length)).map(String::from_utf8_lossy);
    let Some(header) = header else { return Err(wrong("a whole header", format!("{} bytes", bytes.len()))) };
    let after = |key: &str| header.split_once(key).map(|(_, rest)| rest);
    let kind = after("'descr':").and_then(|rest| rest.split('\'').nth(1)).unwrap_or_default().to_owned();
    if after("'fortran_order':").is_none_or(|rest| !rest.trim_start().starts_with("False")) {
        return Err(wrong("rows first", header.trim().to_owned()));
    }
    let shape = after("'shape':").and_then(|rest| Some(rest.split_once('(')?.1.split_once(')')?.0.to_owned()));
    let sizes = shape.unwrap_or_default();
    let sizes: Result<Vec<usize>, _> = sizes.split(',').map(str::trim).filter(|s| !s.is_empty()).map(str::parse).collect();
    let Ok(shape) = sizes else { return Err(wrong("a shape", header.trim().to_owned())) };
    let count = shape.iter().try_fold(1_usize, |a, b| a.checked_mul(*b));
    let data = &bytes[start + length..];
    let size = match kind.as_str() {
        "<f4" => 4,
        "<f8" => 8,
        other => return Err(wrong("numbers of kind <f4 or <f8", other.to_owned())),
    };
    if count.and_then(|n| n.checked_mul(size)) != Some(data.len()) {
        return Err(wrong(&format!("data of {shape:?} numbers of {size} bytes"), format!("{} bytes", data.len())));
    }
    let values = if size == 4 {
        data.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect()
    } else {
        data.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
    };
    Ok(Array { shape, values })
}

/// Rows of three coordinates.
pub(super) fn places(path: &Path) -> Result<Vec<[f64; 3]>, FitError> {
    let array = read(path)?;
    match array.shape[..] {
        [_, 3] => Ok(array.values.as_chunks::<3>().0.to_vec()),
        _ => Err(FitError::content(path, "rows of 3 coordinates", format!("{:?}", array.shape))),
    }
}
