//! Arrays of NumPy.

use crate::error::FitError;
use promenade_audio::npy::Array;
use std::path::Path;

/// Bytes of an array, at most.
const MAX_BYTES: u64 = 4 << 30;

/// Reads an array.
pub(super) fn read(path: &Path) -> Result<Array, FitError> {
    Array::read(path, MAX_BYTES)
}

/// Rows of three coordinates.
pub(super) fn places(path: &Path) -> Result<Vec<[f64; 3]>, FitError> {
    let array = read(path)?;
    match array.shape[..] {
        [_, 3] => Ok(array.values.as_chunks::<3>().0.to_vec()),
        _ => Err(FitError::content(path, "rows of 3 coordinates", format!("{:?}", array.shape))),
    }
}
