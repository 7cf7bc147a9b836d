//! The key by which a project finds its scene again.

use super::factory::{LOFT_HASHES, LOFT_TITLE};
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
    /// Where the file was, relative to the user's home folder, with slashes on every system; empty outside of it.
    pub from_home: PathBuf,
    /// The library slot the scene was chosen by, 0 for none.
    pub slot: u32,
    /// How loud the scene is, tenths of a decibel over the dry sound, which passes at this level where the scene is missing;
    /// `None` where it was never heard.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_cb: Option<i32>,
}

impl SceneKey {
    /// The key of the loft that is built in.
    pub fn loft() -> Self {
        Self { hash: LOFT_HASHES[0].to_owned(), title: LOFT_TITLE.to_owned(), ..Self::default() }
    }

    /// Whether it names the loft that is built in.
    pub fn is_loft(&self) -> bool {
        LOFT_HASHES.contains(&self.hash.as_str())
    }

    /// The key of a file with the content of a hash.
    pub fn to_file(path: &Path, hash: String, title: String, slot: u32) -> Self {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let from_home =
            dirs::home_dir().and_then(|home| absolute.strip_prefix(home).ok().map(with_slashes)).unwrap_or_default();
        Self { hash, title, absolute, from_home, slot, level_cb: None }
    }

    /// Whether it names a scene.
    pub fn is_some(&self) -> bool {
        !self.hash.is_empty() || !self.absolute.as_os_str().is_empty() || !self.from_home.as_os_str().is_empty()
    }

    /// Places where the file should be, best first.
    pub fn places(&self) -> Vec<PathBuf> {
        let home = dirs::home_dir().filter(|_| !self.from_home.as_os_str().is_empty());
        let absolute = Some(self.absolute.clone()).filter(|path| path.is_absolute());
        absolute.into_iter().chain(home.map(|home| home.join(&self.from_home))).collect()
    }

    /// The file's name without its folder; empty if no path is known.
    pub fn file_name(&self) -> &str {
        let named = |path: &'_ Path| path.file_name().is_some();
        let path = if named(&self.absolute) { &self.absolute } else { &self.from_home };
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        // A path of Windows is one name elsewhere; there, a backslash may be part of a name.
        if path.is_absolute() { name } else { name.rsplit('\\').next().unwrap_or(name) }
    }
}

/// A relative path as every system reads it.
fn with_slashes(path: &Path) -> PathBuf {
    let parts = path.iter().map(|part| part.to_str()).collect::<Option<Vec<_>>>();
    parts.map_or_else(|| path.to_owned(), |parts| parts.join("/").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_alike_by_projects_of_all_systems() {
        for (absolute, from_home) in [
            ("/home/ann/Music/hall.promenade", ""),
            ("/Users/ann/Music/hall.promenade", ""),
            (r"C:\Users\ann\Music\hall.promenade", ""),
            ("", "Music/hall.promenade"),
            ("hall.promenade", ""),
        ] {
            let key = SceneKey { absolute: absolute.into(), from_home: from_home.into(), ..SceneKey::default() };
            assert_eq!(key.file_name(), "hall.promenade", "{absolute}");
        }
        assert_eq!(SceneKey::default().file_name(), "");
    }

    #[test]
    fn a_place_in_the_home_folder_is_found_in_another_home() {
        let home = dirs::home_dir().unwrap();
        let file = home.join("Music").join("hall.promenade");
        let key = SceneKey::to_file(&file, "00".to_owned(), "Hall".to_owned(), 0);
        assert_eq!(key.from_home.to_str(), Some("Music/hall.promenade"));
        let moved = SceneKey { absolute: r"D:\elsewhere\hall.promenade".into(), ..key };
        assert!(moved.places().contains(&file));
    }
}
