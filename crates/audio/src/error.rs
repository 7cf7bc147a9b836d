//! What can go wrong with a file, in messages that let the user correct it.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a file could not be read, written or converted. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum FileError {
    /// A file or folder cannot be opened or read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's error.
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
        /// The WAV reader's error.
        source: hound::Error,
    },
    /// A FLAC file is damaged or of an unknown kind.
    #[error("{}: no readable FLAC file", path.display())]
    Flac {
        /// The file.
        path: PathBuf,
        /// The FLAC reader's error.
        source: claxon::Error,
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

impl FileError {
    /// For `map_err`: the file or folder cannot be read.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Read { path, source }
    }

    /// For `map_err`: the file cannot be written.
    pub fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Write { path, source }
    }

    /// The content is not what is needed.
    pub fn content(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), expected: expected.into(), found: found.into() }
    }

    /// One entry is not what is needed.
    pub fn entry(path: &Path, entry: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Entry { path: path.to_path_buf(), entry: entry.into(), expected: expected.into(), found: found.into() }
    }
}
