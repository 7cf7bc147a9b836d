//! What can go wrong between files on disk and a scene, said so that the user can mend it.

use promenade_core::PathError;
use promenade_core::cloud::CloudError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why something could not be loaded, baked or written. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum BakeError {
    /// A file or folder cannot be opened or read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file can be read, but its content is not what is needed.
    #[error("{}: expected {expected}, found {found}", path.display())]
    Content {
        /// The file, with the place inside it where one is known.
        path: PathBuf,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// One entry of a file is not what is needed.
    #[error("{}: {entry}: expected {expected}, found {found}", path.display())]
    Entry {
        /// The file.
        path: PathBuf,
        /// Line, entry or variable inside it.
        entry: String,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A WAV file is damaged or of an unknown kind.
    #[error("{}: no readable WAV file", path.display())]
    Wav {
        /// The file.
        path: PathBuf,
        /// What the WAV reader said.
        source: hound::Error,
    },
    /// A JSON file does not have the expected form.
    #[error("{}: not the JSON that is expected here", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// A SOFA file cannot be read as HDF5.
    #[error("{}: no readable SOFA (HDF5) file", path.display())]
    Sofa {
        /// The file.
        path: PathBuf,
        /// What the HDF5 reader said.
        source: Box<hdf5_pure::Error>,
    },
    /// A file of arrays is damaged or of an unknown kind.
    #[error("{}: no readable {what}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What it should be.
        what: &'static str,
        /// What the reader said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A checkpoint alone cannot be rendered.
    #[error("{}: the file does not hold all that is needed; give also {}", path.display(), missing.join(" and "))]
    Incomplete {
        /// The file.
        path: PathBuf,
        /// Everything that the user has to add.
        missing: Vec<String>,
    },
    /// Weights and anchors were read but make no model.
    #[error("{}: no anchor-cloud model", path.display())]
    Cloud {
        /// The file of the weights.
        path: PathBuf,
        /// What does not fit.
        source: CloudError,
    },
    /// Keyframes were read but make no path.
    #[error("{}: no camera path", path.display())]
    CameraPath {
        /// The file.
        path: PathBuf,
        /// What is wrong with the keyframes.
        source: PathError,
    },
    /// A value given by the user, not in a file, is wrong.
    #[error("{what}: expected {expected}, found {found}")]
    Argument {
        /// Which value.
        what: &'static str,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
    /// A conversion between sample rates is not possible.
    #[error("no conversion from {from_hz} to {to_hz} Hz")]
    Resample {
        /// Rate of the input, hertz.
        from_hz: u32,
        /// Rate asked for, hertz.
        to_hz: u32,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl BakeError {
    pub(crate) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Read { path, source }
    }

    pub(crate) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Write { path, source }
    }

    pub(crate) fn content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), expected: expected.into(), found: found.into() }
    }

    pub(crate) fn entry(path: &Path, entry: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Entry { path: path.to_path_buf(), entry: entry.into(), expected: expected.into(), found: found.into() }
    }
}
