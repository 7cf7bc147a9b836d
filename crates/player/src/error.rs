//! Why a file cannot be played through a scene.

use promenade_fault::Fault;
use std::error::Error;
use std::path::Path;

/// Why a file cannot be played through a scene.
pub type PlayerError = Fault;

/// For `map_err`: what a scene file holds cannot be played as is asked.
pub(crate) fn of<E: Into<Box<dyn Error + Send + Sync>>>(path: &Path) -> impl FnOnce(E) -> Fault {
    move |source| Fault::because(path.display().to_string(), source)
}
