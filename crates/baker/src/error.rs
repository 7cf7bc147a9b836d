//! What can go wrong between files on disk and a scene, said so that the user can mend it.

use promenade_audio::FileError;
use promenade_core::SceneError;
use promenade_core::network::CloudError;
use promenade_core::published::PublishedError;
use promenade_paths::PathFileError;
use promenade_room::RoomError;
use promenade_sofa::SofaError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why something could not be loaded, baked or written. Sources are chained, not repeated in the message.
#[derive(Debug, Error)]
pub enum BakeError {
    /// A file cannot be read, written or converted, or its content is not what is needed.
    #[error(transparent)]
    File(#[from] FileError),
    /// Cameras or a camera path cannot be read, or cannot be placed as the options say.
    #[error(transparent)]
    Path(#[from] PathFileError),
    /// A JSON file does not have the expected form.
    #[error("{}: not the JSON that is expected here", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// A room makes no scene.
    #[error(transparent)]
    Room(#[from] RoomError),
    /// A SOFA file cannot be read, or makes no head.
    #[error(transparent)]
    Sofa(#[from] SofaError),
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
    /// A capture cannot be used; everything that is wrong with it at once.
    #[error("{}: {}", path.display(), defects.join("; "))]
    Capture {
        /// The manifest.
        path: PathBuf,
        /// What is wrong, each by the name of its track or clip.
        defects: Vec<String>,
    },
    /// A response or a rendering cannot be measured.
    #[error("{what} cannot be measured")]
    Unmeasurable {
        /// Its name, with what it is.
        what: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A scene cannot be played.
    #[error(transparent)]
    Player(#[from] promenade_player::PlayerError),
    /// A setting of a scene has no figures.
    #[error(transparent)]
    Judge(#[from] promenade_judge::JudgeError),
    /// What was made does not hold together as a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A model cannot be rendered by the published head.
    #[error(transparent)]
    Published(#[from] PublishedError),
    /// A room cannot be made or traced.
    #[error(transparent)]
    Acoustics(#[from] promenade_acoustics::AcousticsError),
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
}

impl BakeError {
    /// A file that cannot be read, from what the system says.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let convert = FileError::read(path);
        move |source| convert(source).into()
    }

    /// A file with something else in it than was expected.
    #[must_use]
    pub fn content(path: &Path, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::content(path, expected, found.to_string()).into()
    }

    pub(crate) fn argument(what: &'static str, expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Argument { what, expected: expected.into(), found: found.to_string() }
    }

    pub(crate) fn unmeasurable(what: String, why: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Unmeasurable { what, source: why.into() }
    }

    pub(crate) fn entry(path: &Path, entry: impl Into<String>, expected: impl Into<String>, found: impl ToString) -> Self {
        FileError::entry(path, entry, expected, found.to_string()).into()
    }

    pub(crate) fn json(path: &Path) -> impl Fn(serde_json::Error) -> Self {
        move |source| Self::Json { path: path.to_path_buf(), source }
    }

    pub(crate) fn unreadable(
        path: &Path,
        what: &'static str,
        why: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Self {
        Self::Unreadable { path: path.to_path_buf(), what, source: why.into() }
    }
}
