//! What can be wrong with a room.

#[cfg(feature = "meshes")]
use std::path::Path;
use std::path::PathBuf;
use thiserror::Error;

/// Why a room cannot be made or traced. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum AcousticsError {
    /// A file cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file does not hold what is needed.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A value is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Argument {
        /// Which value.
        what: String,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
}

impl AcousticsError {
    pub(crate) fn argument(what: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Argument { what: what.into(), expected: expected.into(), found: found.to_string() }
    }

    #[cfg(feature = "meshes")]
    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Content { path: path.to_path_buf(), expected: expected.into(), found: found.to_string() }
    }

    #[cfg(feature = "meshes")]
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Read { path: path.to_path_buf(), source }
    }
}

/// A place that is three finite numbers.
pub(crate) fn place(what: &str, at: [f64; 3]) -> Result<glam::DVec3, AcousticsError> {
    let place = glam::DVec3::from_array(at);
    if place.is_finite() {
        return Ok(place);
    }
    Err(AcousticsError::argument(what, "three finite coordinates in metres", place))
}
