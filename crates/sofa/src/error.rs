//! What can go wrong with a SOFA file.

use promenade_audio::FileError;
use promenade_core::HeadError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a SOFA file cannot be read or makes no head. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum SofaError {
    /// The file cannot be read, or its content is not what is needed.
    #[error(transparent)]
    File(#[from] FileError),
    /// It cannot be read as HDF5.
    #[error("{}: no readable SOFA (HDF5) file", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// What the HDF5 reader said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Its responses are those of no head.
    #[error("{}: no head", path.display())]
    Head {
        /// The file.
        path: PathBuf,
        /// What is wrong with them.
        source: HeadError,
    },
}

impl SofaError {
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let convert = FileError::read(path);
        move |source| convert(source).into()
    }

    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::content(path, expected, found.to_string()).into()
    }

    pub(crate) fn entry(path: &Path, entry: &str, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::entry(path, entry, expected, found.to_string()).into()
    }
}
