//! Presets: the factory's inside the plugin, the user's as files, all in Steinberg's format, so that VST3 hosts list them too.

use crate::library::{file_name_of, read_limited};
use nice_plug::plugin::PluginState;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Extension of preset files.
pub const EXTENSION: &str = "vstpreset";
/// Larger files are refused unread, bytes.
const LARGEST_FILE: u64 = 64 << 20;
/// Bytes before the first chunk: `VST3`, a version, the class id in hexadecimal, the place of the chunk list.
const HEADER: usize = 48;
/// The class id in hexadecimal as hosts write it.
const CLASS_ID: std::ops::Range<usize> = 8..40;

macro_rules! factory {
    ($($name:literal),* $(,)?) => {
        /// Names and contents of the presets inside the plugin.
        const FACTORY: &[(&str, &[u8])] = &[$((
            $name,
            include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../presets/plugin/", $name, ".vstpreset")),
        )),*];
    };
}

factory![
    "Class room, back row",
    "Class room, facing the source",
    "Class room, walk round the source",
    "Direct sound only, for head tracking on many tracks",
    "Half dry, source on the left",
    "Office, at the door",
    "Office, facing the source",
];

/// A preset that can be chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// Its file; `None` for a factory preset.
    pub file: Option<PathBuf>,
}

/// Why a preset cannot be read or saved.
#[derive(Debug, Error)]
pub enum PresetError {
    /// The file cannot be read or written.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        error: io::Error,
    },
    /// The file is not a preset of this plugin.
    #[error("{what}: expected a preset of Promenade, found {found}")]
    Content {
        /// The file or the factory preset.
        what: String,
        /// What was found.
        found: String,
    },
    /// The name cannot be a file name.
    #[error("\"{0}\" cannot be a preset's name: expected a file name without separators")]
    Name(String),
    /// The system names no folder for the user's presets.
    #[error("this system names no home folder to keep presets in")]
    NoFolder,
}

/// Where VST3 hosts look for the user's presets of this plugin.
///
/// Source: VST 3 SDK documentation, "Preset locations".
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let base = if cfg!(target_os = "windows") {
        dirs::document_dir()?.join("VST3 Presets")
    } else if cfg!(target_os = "macos") {
        dirs::home_dir()?.join("Library/Audio/Presets")
    } else {
        dirs::home_dir()?.join(".vst3/presets")
    };
    Some(base.join("Promenade").join("Promenade"))
}

/// The factory presets, then those in the user's folder, each sorted by name.
#[must_use]
pub fn list(folder: Option<&Path>) -> Vec<Preset> {
    let factory = FACTORY.iter().map(|(name, _)| Preset { name: (*name).to_owned(), file: None });
    let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    let mut users = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == EXTENSION))
        .filter_map(|path| Some(Preset { name: path.file_stem()?.to_str()?.to_owned(), file: Some(path) }))
        .collect::<Vec<_>>();
    users.sort_by(|a, b| a.name.cmp(&b.name));
    factory.chain(users).collect()
}

/// The state in a preset.
///
/// # Errors
/// The file cannot be read or is not a preset of this plugin.
pub fn read(preset: &Preset) -> Result<PluginState, PresetError> {
    let Some(path) = &preset.file else {
        let known = FACTORY.iter().find(|(name, _)| *name == preset.name);
        let none = || PresetError::Content { what: preset.name.clone(), found: "no factory preset of that name".to_owned() };
        return state_in(known.ok_or_else(none)?.1, &preset.name);
    };
    let bytes = read_limited(path, LARGEST_FILE).map_err(|error| PresetError::Io { path: path.clone(), error })?;
    state_in(&bytes, &path.display().to_string())
}

/// Saves a state under a name in the user's folder, and replaces a preset of that name.
///
/// # Errors
/// The name cannot be a file name, or the file cannot be written.
pub fn save(folder: &Path, name: &str, state: &PluginState) -> Result<Preset, PresetError> {
    let name = file_name_of(name).ok_or_else(|| PresetError::Name(name.trim().to_owned()))?;
    let path = folder.join(format!("{name}.{EXTENSION}"));
    let io_error = |error| PresetError::Io { path: path.clone(), error };
    std::fs::create_dir_all(folder).map_err(io_error)?;
    let json = serde_json::to_vec(state).map_err(|error| io_error(io::Error::other(error)))?;
    // A crash half way leaves the old preset.
    let partial = path.with_extension("partial");
    std::fs::write(&partial, file_of(&json)).and_then(|()| std::fs::rename(&partial, &path)).map_err(io_error)?;
    Ok(Preset { name: name.to_owned(), file: Some(path) })
}

/// Steinberg's preset file: header, the component's state, an empty state of the controller, and the list of both.
fn file_of(component: &[u8]) -> Vec<u8> {
    let (start, end) = (HEADER as u64, (HEADER + component.len()) as u64);
    let template = FACTORY[0].1;
    let mut bytes = b"VST3".to_vec();
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend(&template[CLASS_ID]);
    bytes.extend(end.to_le_bytes());
    bytes.extend(component);
    bytes.extend(b"List");
    bytes.extend(2_u32.to_le_bytes());
    for (id, at, length) in [(b"Comp", start, component.len() as u64), (b"Cont", end, 0)] {
        bytes.extend(id);
        bytes.extend(at.to_le_bytes());
        bytes.extend(length.to_le_bytes());
    }
    bytes
}

fn state_in(bytes: &[u8], what: &str) -> Result<PluginState, PresetError> {
    let wrong = |found: &str| PresetError::Content { what: what.to_owned(), found: found.to_owned() };
    let number = |at: usize, len: usize| {
        let field = bytes.get(at..at + len)?;
        let mut word = [0; 8];
        word[..len].copy_from_slice(field);
        usize::try_from(u64::from_le_bytes(word)).ok()
    };
    if bytes.get(..4) != Some(b"VST3") {
        return Err(wrong("another kind of file"));
    }
    if bytes.get(CLASS_ID) != FACTORY[0].1.get(CLASS_ID) {
        return Err(wrong("a preset of another plugin"));
    }
    let list = number(40, 8).filter(|at| bytes.get(*at..at.saturating_add(4)) == Some(b"List"));
    let list = list.ok_or_else(|| wrong("a preset without a list of its parts"))?;
    let count = number(list + 4, 4).unwrap_or(0);
    let entry = (0..count.min(64)).map(|n| list + 8 + 20 * n).find(|at| bytes.get(*at..at + 4) == Some(b"Comp"));
    let component = entry.and_then(|at| {
        let (start, length) = (number(at + 4, 8)?, number(at + 12, 8)?);
        bytes.get(start..start.checked_add(length)?)
    });
    let component = component.ok_or_else(|| wrong("a preset without the plugin's state, or cut short"))?;
    serde_json::from_slice(component).map_err(|error| wrong(&format!("a state that cannot be read ({error})")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nice_plug::plugin::ParamValue;

    #[test]
    fn every_factory_preset_can_be_read() {
        for preset in list(None) {
            let state = read(&preset).unwrap();
            assert!(matches!(state.params["x"], ParamValue::F32(_)), "{}", preset.name);
        }
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/plugin");
        let files = std::fs::read_dir(folder).unwrap().flatten();
        let mut on_disk = files.filter_map(|e| Some(e.path().file_stem()?.to_str()?.to_owned())).collect::<Vec<_>>();
        on_disk.sort();
        assert_eq!(on_disk, FACTORY.iter().map(|(name, _)| *name).collect::<Vec<_>>(), "a preset is not built in");
    }

    #[test]
    fn a_user_preset_comes_back_and_is_written_as_hosts_write_it() {
        let folder = tempfile::tempdir().unwrap();
        let mut state = read(&list(None)[0]).unwrap();
        state.params.insert("x".to_owned(), ParamValue::F32(-2.25));
        let saved = save(folder.path(), " Mine ", &state).unwrap();
        let listed = list(Some(folder.path()));
        assert_eq!(listed.last(), Some(&saved));
        assert_eq!(saved.name, "Mine");
        let json = |state: &PluginState| serde_json::to_string(state).unwrap();
        assert_eq!(json(&read(&saved).unwrap()), json(&state));
        let factory = FACTORY[0].1;
        let json = &factory[HEADER..usize::try_from(u64::from_le_bytes(factory[40..48].try_into().unwrap())).unwrap()];
        assert_eq!(file_of(json), factory);
    }

    #[test]
    fn names_that_are_paths_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let state = read(&list(None)[0]).unwrap();
        for name in ["", " ", "../x", "a/b", ".hidden", "C:x", ".."] {
            assert!(matches!(save(folder.path(), name, &state), Err(PresetError::Name(_))), "{name}");
        }
    }

    #[test]
    fn damage_is_an_error_that_names_the_file() {
        let whole = FACTORY[0].1;
        // The list's last entry, of the controller's empty state, is not needed.
        for length in 0..whole.len() - 20 {
            assert!(state_in(&whole[..length], "f").is_err(), "{length}");
        }
        for at in (0..HEADER).chain(whole.len() - 60..whole.len()) {
            let mut bytes = whole.to_vec();
            bytes[at] ^= 0x55;
            // Some bytes do not matter; none may bring the reader down.
            if let Err(error) = state_in(&bytes, "some.vstpreset") {
                assert!(error.to_string().starts_with("some.vstpreset"), "{error}");
            }
        }
    }
}
