//! What can be wrong with a scene.

use super::cost::TooCostly;
use super::manifest::{MAX_SCENE_BYTES, VERSION};
use crate::network::CloudError;
use promenade_fault::Fault;
use thiserror::Error;

/// Why bytes are no scene.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file is larger than is read.
    #[error("the scene has {found} bytes, expected at most {MAX_SCENE_BYTES}")]
    TooLarge {
        /// Its size, bytes.
        found: usize,
    },
    /// The container is cut off or damaged.
    #[error("not a whole scene file (safetensors container): {0}")]
    Container(String),
    /// The container holds no manifest, or one that is not understood.
    #[error("the scene's manifest is damaged or missing: {0}")]
    Manifest(String),
    /// Written by another version of Promenade.
    #[error("the scene has format version {found}, expected {VERSION}")]
    Version {
        /// Its version.
        found: u64,
    },
    /// The content does not match its checksum.
    #[error("the scene is damaged: its checksum is {found:08x}, expected {expected:08x}")]
    Checksum {
        /// Checksum stored in the file.
        expected: u32,
        /// Checksum of what was read.
        found: u32,
    },
    /// A tensor is missing or has another type or shape.
    #[error("tensor '{name}' of the scene: expected {expected}, found {found}")]
    Tensor {
        /// Name of the tensor.
        name: String,
        /// Type and shape that the manifest asks for.
        expected: String,
        /// Type and shape in the file.
        found: String,
    },
    /// The anchor cloud's weights do not fit together.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// Playing it would take too much.
    #[error(transparent)]
    Cost(#[from] TooCostly),
    /// A value is out of range or not finite.
    #[error("{what} of the scene: expected {expected}, found {found}")]
    Value {
        /// What the value is.
        what: String,
        /// Its range.
        expected: String,
        /// The value.
        found: String,
    },
}

impl From<SceneError> for Fault {
    fn from(error: SceneError) -> Self {
        Self::of(error)
    }
}

/// A value out of range.
pub(super) fn value(what: &str, expected: impl ToString, found: impl ToString) -> SceneError {
    SceneError::Value { what: what.to_owned(), expected: expected.to_string(), found: found.to_string() }
}
