//! The key by which a project finds its scene again.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A scene file by content and by place, so that a moved project or library still finds it.
///
/// An empty `hash` names no scene. Fields that a newer version has added are ignored, missing ones are empty.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneKey {
    /// BLAKE3 of the file, hexadecimal.
    pub hash: String,
    /// The scene's title, to name it when the file is gone.
    pub title: String,
    /// Where the file was.
    pub absolute: PathBuf,
    /// Where the file was, relative to the user's home folder; empty outside of it.
    pub from_home: PathBuf,
    /// The library slot the scene was chosen by, 0 for none.
    pub slot: u32,
}

impl SceneKey {
    /// The key of a file with the content of a hash.
    #[must_use]
    pub fn to_file(path: &Path, hash: String, title: String, slot: u32) -> Self {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let from_home =
            dirs::home_dir().and_then(|home| absolute.strip_prefix(home).ok().map(Path::to_owned)).unwrap_or_default();
        Self { hash, title, absolute, from_home, slot }
    }

    /// Whether it names a scene.
    #[must_use]
    pub fn is_some(&self) -> bool {
        !self.hash.is_empty() || !self.absolute.as_os_str().is_empty() || !self.from_home.as_os_str().is_empty()
    }

    /// Places where the file should be, best first.
    #[must_use]
    pub fn places(&self) -> Vec<PathBuf> {
        let home = dirs::home_dir().filter(|_| !self.from_home.as_os_str().is_empty());
        let absolute = Some(self.absolute.clone()).filter(|path| path.is_absolute());
        absolute.into_iter().chain(home.map(|home| home.join(&self.from_home))).collect()
    }

    /// The file's name without its folder; empty if no path is known.
    #[must_use]
    pub fn file_name(&self) -> &str {
        let named = |path: &'_ Path| path.file_name().is_some();
        let path = if named(&self.absolute) { &self.absolute } else { &self.from_home };
        path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
    }
}
