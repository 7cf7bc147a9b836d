//! Scenes and camera paths from files.

use crate::PlayerError;
use promenade_audio::{FileError, file};
use promenade_core::{MAX_SCENE_BYTES, Scene};
use promenade_paths::{ImportOptions, Imported, MAX_FILE_BYTES, bytes_of};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a folder keeps the images of a COLMAP model, of which COLMAP itself prefers the binary form, or the cameras of a NeRF
/// tool.
const IN_FOLDER: [&str; 7] = [
    "images.bin",
    "images.txt",
    "sparse/0/images.bin",
    "sparse/0/images.txt",
    "sparse/images.bin",
    "sparse/images.txt",
    "transforms.json",
];

/// Reads a scene.
///
/// # Errors
/// A file that is missing, no regular file or no scene.
pub fn read_scene(path: &Path) -> Result<Arc<Scene>, PlayerError> {
    let bytes = file::read(path, MAX_SCENE_BYTES as u64).map_err(FileError::read(path))?;
    let ending = path.extension().map(|ending| ending.display().to_string()).filter(|e| !e.eq_ignore_ascii_case("promenade"));
    let wrong = |error| match &ending {
        Some(ending) => {
            let expected = "a scene, which is the first file and ends in .promenade";
            FileError::content(path, expected, format!("a file that ends in .{ending}"))
        }
        None => PlayerError::unreadable(path, "scene", error),
    };
    Ok(Arc::new(Scene::from_bytes(&bytes).map_err(wrong)?))
}

/// Reads a camera path of any form, of a COLMAP model or a NeRF tool also by its folder.
///
/// # Errors
/// A file that is missing, no regular file or no camera path, or an option that is not for this kind of file.
pub fn read_path(path: &Path, options: &ImportOptions) -> Result<Imported, PlayerError> {
    let file = if path.is_dir() { images_in(path)? } else { path.to_path_buf() };
    let bytes = file::open(&file).and_then(|mut file| bytes_of(&mut file)).map_err(FileError::read(&file))?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut beside = |uri: &str| file::read(&folder.join(uri), MAX_FILE_BYTES);
    promenade_paths::read(&file.display().to_string(), &bytes, options, &mut beside)
}

fn images_in(folder: &Path) -> Result<PathBuf, FileError> {
    let found = IN_FOLDER.iter().map(|name| folder.join(name)).find(|file| file.is_file());
    found.ok_or_else(|| {
        let names = format!("{} or sparse/0/images.bin", IN_FOLDER[..2].join(", "));
        FileError::content(folder, format!("a COLMAP model, a folder with {names}, or a transforms.json"), "none of them")
    })
}
