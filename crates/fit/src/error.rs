//! What can go wrong with a fit.

use promenade_acoustics::AcousticsError;
use promenade_audio::FileError;
use promenade_sofa::SofaError;
use std::path::Path;
use thiserror::Error;

/// Why measurements cannot be read or a room cannot be fitted to them.
#[derive(Debug, Error)]
pub enum FitError {
    /// A file cannot be read or written, or its content is not what is needed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A SOFA file is not what is needed.
    #[error(transparent)]
    Sofa(#[from] SofaError),
    /// The room is no room.
    #[error(transparent)]
    Room(#[from] AcousticsError),
    /// A value that was asked for is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Argument {
        /// What it is.
        what: String,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The measurements cannot be what they are said to be.
    #[error("measurement {name}: expected {expected}, found {found}")]
    Measurement {
        /// Which one.
        name: String,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
}

impl FitError {
    pub(crate) fn argument(what: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Argument { what: what.into(), expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn measurement(name: &str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Measurement { name: name.to_owned(), expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::content(path, expected, found.to_string()).into()
    }

    pub(crate) fn entry(path: &Path, entry: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::entry(path, entry, expected, found.to_string()).into()
    }
}
