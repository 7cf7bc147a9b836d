//! Why a room makes no scene.

use promenade_acoustics::AcousticsError;
use promenade_core::SceneError;
use thiserror::Error;

/// Why a room makes no scene.
#[derive(Debug, Error)]
pub enum RoomError {
    /// A value is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Argument {
        /// Which value.
        what: &'static str,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The acoustics cannot be computed.
    #[error(transparent)]
    Acoustics(#[from] AcousticsError),
    /// What was made is not a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl RoomError {
    pub(crate) fn argument(what: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Argument { what, expected: expected.into(), found: found.to_string() }
    }
}
