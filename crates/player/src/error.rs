//! Why a file cannot be played through a scene.

use promenade_audio::FileError;
use promenade_core::SceneError;
use promenade_core::published::PublishedError;
use promenade_paths::PathFileError;
use promenade_sofa::SofaError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a file cannot be played through a scene. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum PlayerError {
    /// A file cannot be read, written or converted, or its content is not what is needed.
    #[error(transparent)]
    File(#[from] FileError),
    /// A camera path cannot be read.
    #[error(transparent)]
    Path(#[from] PathFileError),
    /// A head or headphones cannot be read.
    #[error(transparent)]
    Sofa(#[from] SofaError),
    /// A scene cannot be read.
    #[error("{}: no readable scene", path.display())]
    Scene {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: SceneError,
    },
    /// A scene cannot be changed as is asked.
    #[error(transparent)]
    Change(#[from] SceneError),
    /// A model cannot be rendered by the published head.
    #[error(transparent)]
    Published(#[from] PublishedError),
    /// A value that was given is wrong.
    #[error("{what}: expected {expected}, found {found}")]
    Argument {
        /// Which value.
        what: &'static str,
        /// What would have been right.
        expected: String,
        /// What was given.
        found: String,
    },
    /// What a scene file holds cannot be played as is asked.
    #[error("{}", path.display())]
    Of {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl PlayerError {
    pub(crate) fn argument(what: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Argument { what, expected: expected.into(), found: found.to_string() }
    }

    /// For `map_err`: what a scene file holds cannot be played as is asked.
    pub(crate) fn of<E: Into<Box<dyn std::error::Error + Send + Sync>>>(path: &Path) -> impl FnOnce(E) -> Self {
        move |source| Self::Of { path: path.to_path_buf(), source: source.into() }
    }
}
