//! The user's own scenes and camera paths on disk, and the search for a scene that has moved.

pub mod cache;
pub mod drawn_room;
pub mod factory;
pub(crate) mod file;
pub mod front;
mod kept_fronts;
pub mod level;
pub mod lister;
pub mod outline;
pub mod scene_key;
pub mod slots;

use cache::ContentHash;
use file::{file_name_of, read_limited};
use promenade_core::Scene;
use promenade_fault::Fault;
use scene_key::SceneKey;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// Folders to search for scenes and camera paths before the user's own, separated as in `PATH`.
pub const FOLDERS_VARIABLE: &str = "PROMENADE_SCENES";
/// Extension of scene files.
pub const SCENES: &[&str] = &["promenade"];
/// Extensions of camera path files.
pub const WALKS: &[&str] = &["csv", "glb", "gltf", "json"];
/// Larger files are refused unread, bytes.
const LARGEST_FILE: u64 = promenade_core::MAX_SCENE_BYTES as u64;

/// A scene in memory and how to find it again.
pub struct LoadedScene {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The scene's content.
    pub hash: ContentHash,
    /// Its content and place.
    pub key: SceneKey,
    /// A remark for the user, such as that the file has changed; usually empty.
    pub note: String,
}

/// Why no scene or camera path can be played.
#[derive(Debug, Error)]
pub enum LoadError {
    /// No file was chosen: an empty slot of the library, or no scene in the project.
    #[error("{0}")]
    NoneChosen(String),
    /// What was chosen cannot be played.
    #[error(transparent)]
    Fault(#[from] Fault),
}

/// Folders where an installer for all users of a system puts scenes, whether they are there or not.
pub fn installed_folders() -> Vec<PathBuf> {
    let roots: Vec<PathBuf> = if cfg!(target_os = "macos") {
        vec!["/Library/Application Support".into()]
    } else if cfg!(windows) {
        std::env::var_os("PROGRAMDATA").map(PathBuf::from).into_iter().collect()
    } else {
        // The XDG Base Directory Specification's.
        let named = std::env::var_os("XDG_DATA_DIRS").filter(|named| !named.is_empty());
        std::env::split_paths(&named.unwrap_or_else(|| "/usr/local/share:/usr/share".into())).collect()
    };
    roots.into_iter().filter(|root| root.is_absolute()).map(|root| root.join("promenade").join("scenes")).collect()
}

/// The folders that hold the user's files: those of `PROMENADE_SCENES`, those of an installer for all users where it has made
/// them, then `promenade/scenes` in the user's data folder.
pub fn folders() -> Vec<PathBuf> {
    let named = std::env::var_os(FOLDERS_VARIABLE).unwrap_or_default();
    let named = std::env::split_paths(&named).filter(|path| path.is_absolute()).collect::<Vec<_>>();
    let installed = installed_folders().into_iter().filter(|folder| folder.is_dir());
    named.into_iter().chain(installed).chain(dirs::data_dir().map(|data| data.join("promenade").join("scenes"))).collect()
}

/// The place of a file that a user names: as it is, or in the library's own folder where the name has no folder.
pub fn place_of(name: &str) -> PathBuf {
    let path = PathBuf::from(name.trim());
    let own = folders().pop().filter(|_| path.parent().is_some_and(|parent| parent.as_os_str().is_empty()));
    own.map_or_else(|| path.clone(), |folder| folder.join(&path))
}

/// The files with one of these extensions, folder by folder, in order of their names.
pub fn files(folders: &[PathBuf], extensions: &[&str]) -> Vec<PathBuf> {
    let wanted = |name: &str| name.rsplit_once('.').is_some_and(|(_, extension)| extensions.contains(&extension));
    let mut all = Vec::new();
    for folder in folders {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut here = entries.filter(|path| path.file_name().and_then(|n| n.to_str()).is_some_and(wanted)).collect::<Vec<_>>();
        here.sort();
        all.append(&mut here);
    }
    all
}

/// The bytes of a regular file of at most 1 GiB.
///
/// # Errors
/// The file cannot be read, is no regular file, or is larger than 1 GiB.
pub fn read(path: &Path) -> Result<Vec<u8>, Fault> {
    bytes_of(path).map_err(Fault::read(path))
}

/// The bytes of a regular file of at most 1 GiB, or the system's error.
pub(crate) fn bytes_of(path: &Path) -> io::Result<Vec<u8>> {
    read_limited(path, LARGEST_FILE)
}

/// The scene in the file of a slot.
///
/// # Errors
/// The file is not a scene.
pub fn scene_in_slot(path: &Path, slot: u32) -> Result<LoadedScene, LoadError> {
    let (scene, hash) = scene_at(path)?;
    let key = SceneKey::to_file(path, hash.clone(), scene.title().to_owned(), slot);
    Ok(LoadedScene { scene, hash, key, note: String::new() })
}

/// The scene a project names: in memory, built in, where it was, where it was from home, by file name in the library, by
/// content in the library.
///
/// A file with the right name and other content is used only when no file has the right content, and is reported.
///
/// # Errors
/// The project names no scene, or there is no file with that content or that name, or it is not a scene.
pub fn scene_of(folders: &[PathBuf], wanted: &SceneKey) -> Result<LoadedScene, LoadError> {
    if !wanted.is_some() {
        const NONE: &str = "the scene is set to the library, but neither a slot is chosen nor a scene saved with the project";
        return Err(LoadError::NoneChosen(NONE.to_owned()));
    }
    if let Some(scene) = cache::in_memory(&wanted.hash) {
        return Ok(LoadedScene { scene, hash: wanted.hash.clone(), key: wanted.clone(), note: String::new() });
    }
    if wanted.is_loft() {
        let (scene, hash) = cache::factory_scene(factory::LOFT)?;
        return Ok(LoadedScene { scene, hash, key: wanted.clone(), note: String::new() });
    }
    let library = files(folders, SCENES);
    let same_name = |path: &&PathBuf| path.file_name().and_then(|n| n.to_str()) == Some(wanted.file_name());
    let by_name = wanted.places().into_iter().chain(library.iter().filter(same_name).cloned()).collect::<Vec<_>>();
    let found = by_name.iter().chain(&library).find(|path| holds(path, &wanted.hash));
    // Of what is no regular file, the error says what it is.
    let there = || by_name.iter().find(|path| path.is_file()).or_else(|| by_name.iter().find(|path| path.exists()));
    let Some(path) = found.or_else(there) else {
        let studio = factory::STUDIO;
        if wanted.file_name().strip_suffix(".promenade") != Some(studio.id) {
            return Err(missing(folders, wanted).into());
        }
        let (scene, hash) = cache::factory_scene(studio)?;
        return Ok(LoadedScene { scene, hash, key: wanted.clone(), note: String::new() });
    };
    let (scene, hash) = scene_at(path)?;
    let changed = !wanted.hash.is_empty() && hash != wanted.hash;
    let note = if changed {
        format!("{} has changed: its BLAKE3 is {hash}, the project was saved with {}", path.display(), wanted.hash)
    } else {
        String::new()
    };
    let mut key = SceneKey::to_file(path, hash.clone(), scene.title().to_owned(), wanted.slot);
    key.level_cb = wanted.level_cb;
    if changed {
        // The project keeps asking for the scene it was made with, in case that comes back.
        key = wanted.clone();
    }
    Ok(LoadedScene { scene, hash, key, note })
}

/// What a user is told of a scene whose file is not there: its name, and one way to get it.
fn missing(folders: &[PathBuf], wanted: &SceneKey) -> Fault {
    let (title, file) = (&wanted.title, wanted.file_name());
    let own = folders.last().map_or_else(String::new, |folder| folder.display().to_string());
    let way = match factory::place(file) {
        Some(_) => format!("It is in the folder scenes of Promenade's archive: copy it to {own}, then press Try again"),
        None => format!("It was at {}: copy it there or to {own}, then press Try again", wanted.absolute.display()),
    };
    Fault::new(format!("{file} of \"{title}\" is missing, and the dry sound passes at the scene's level. {way}"))
}

/// Whether a file of that name, or one that is built in for it, can be played.
pub fn has_file(folders: &[PathBuf], wanted: &SceneKey) -> bool {
    let file = wanted.file_name();
    let is_there = || wanted.places().iter().any(|path| path.is_file()) || folders.iter().any(|f| f.join(file).is_file());
    !wanted.is_some() || wanted.is_loft() || file.strip_suffix(".promenade") == Some(factory::STUDIO.id) || is_there()
}

/// Writes a scene with a title into the last of the folders, the library's own, as a new file of that name. Returns its path.
///
/// # Errors
/// A name that is no file name or is taken, a file that cannot be written.
pub fn save(folders: &[PathBuf], title: &str, scene: &Scene) -> Result<PathBuf, Fault> {
    let no_name = || Fault::unexpected("a name without a folder", format_args!("{title:?}"));
    let name = file_name_of(title).ok_or_else(no_name)?;
    let folder = folders.last().ok_or_else(no_name)?;
    let path = folder.join(format!("{name}.{}", SCENES[0]));
    let io_error = Fault::write(&path);
    if path.exists() {
        return Err(io_error(io::Error::new(io::ErrorKind::AlreadyExists, "there is a scene of this name already")));
    }
    let mut parts = scene.parts().clone();
    name.clone_into(&mut parts.provenance.title);
    let bytes = Scene::new(parts)
        .and_then(|scene| scene.to_bytes())
        .map_err(|error| Fault::because("the scene cannot be written", error))?;
    std::fs::create_dir_all(folder).map_err(&io_error)?;
    file::write_whole(&path, &bytes).map_err(io_error)?;
    Ok(path)
}

fn holds(path: &Path, hash: &str) -> bool {
    read(path).is_ok_and(|bytes| cache::content_hash(&bytes) == hash)
}

/// The scene in a file, and its content.
///
/// # Errors
/// The file cannot be read or is not a scene.
pub fn scene_at(path: &Path) -> Result<(Arc<Scene>, ContentHash), Fault> {
    cache::scene_from(&read(path)?).map_err(Fault::at(path, "no scene"))
}

#[cfg(test)]
pub(crate) mod tests;
