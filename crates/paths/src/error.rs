//! What can be wrong with a file of a path, said so that the user can mend it.

use promenade_core::PathError;
use thiserror::Error;

/// Why a file holds no camera path. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum PathFileError {
    /// The content is not what is needed.
    #[error("{file}: {}expected {expected}, found {found}", place.as_ref().map(|p| format!("{p}: ")).unwrap_or_default())]
    Content {
        /// Name of the file.
        file: String,
        /// Line, image, node or accessor inside it, where one is to blame.
        place: Option<String>,
        /// What would have been right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// It is no JSON, or JSON of another form.
    #[error("{file}: not the JSON that is expected here")]
    Json {
        /// Name of the file.
        file: String,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// It is no glTF file.
    #[error("{file}: no readable glTF file")]
    Gltf {
        /// Name of the file.
        file: String,
        /// What the glTF reader said.
        source: Box<::gltf::Error>,
    },
    /// A file that a glTF file names cannot be read.
    #[error("{file}: its buffer {uri} cannot be read")]
    Buffer {
        /// Name of the glTF file.
        file: String,
        /// Name of the buffer's file as it is written there.
        uri: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// Keyframes were read but make no path.
    #[error("{file}: no camera path")]
    Keyframes {
        /// Name of the file.
        file: String,
        /// What is wrong with them.
        source: PathError,
    },
    /// An option is out of range, or is not for this kind of file.
    #[error("option {option}: expected {expected}, found {found}")]
    Option {
        /// Name of the field of [`crate::ImportOptions`].
        option: &'static str,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
}

impl PathFileError {
    pub(crate) fn content(file: &str, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Content { file: file.to_owned(), place: None, expected: expected.into(), found: found.into() }
    }

    pub(crate) fn at(file: &str, place: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Content { file: file.to_owned(), place: Some(place.into()), expected: expected.into(), found: found.into() }
    }

    pub(crate) fn option(option: &'static str, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Option { option, expected: expected.into(), found: found.into() }
    }
}
