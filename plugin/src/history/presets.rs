//! Presets: the factory's inside the plugin, the user's as files, all in Steinberg's format, so that VST3 hosts list them too.

mod file;

use crate::library::file::{file_name_of, read_limited, write_whole};
use crate::library::scene_key::SceneKey;
pub use file::About;
use nice_plug::plugin::{ParamValue, PluginState};
use promenade_fault::Fault;
use std::io;
use std::path::{Path, PathBuf};

/// Extension of preset files.
pub const EXTENSION: &str = "vstpreset";
/// Larger files are refused unread, bytes.
const LARGEST_FILE: u64 = 64 << 20;

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
    "Cathedral, in the nave",
    "Class room, back row",
    "Class room, facing the source",
    "Class room, walk round the source",
    "Club, at the bar",
    "Club, in front of the stage",
    "Concert hall, last row",
    "Concert hall, tenth row",
    "Corridor, walk to the source",
    "Courtyard, far corner",
    "Direct sound only, for head tracking on many tracks",
    "Dry studio, beside the player",
    "Half dry, source on the left",
    "Living room, across the table",
    "Loft, a voice walks past",
    "Loft, round the corner",
    "Loft, walk round the corner",
    "Office, at the door",
    "Office, facing the source",
    "Parking deck, from afar",
    "Stairwell, behind you",
    "Street, on the other side",
];

/// A preset that can be chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// Its file; `None` for a factory preset.
    pub file: Option<PathBuf>,
    /// What it says of itself.
    pub about: About,
    /// The scene's file that it plays, if it does not play one that is built in.
    pub scene: Option<SceneKey>,
}

/// What is expected of a preset's file.
const PRESET: &str = "a preset of Promenade";

/// Where VST3 hosts look for the user's presets of this plugin.
///
/// Source: VST 3 SDK documentation, "Preset locations".
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

/// The factory presets, then those in the user's folder, each sorted by name. Copies of factory presets, which VST3 hosts find
/// in that folder, are left out.
pub fn list(folder: Option<&Path>) -> Vec<Preset> {
    let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    let mut users = entries.filter_map(|entry| of_file(&entry.path())).collect::<Vec<_>>();
    users.sort_by(|a, b| a.name.cmp(&b.name));
    factory().chain(users).collect()
}

/// The presets inside the plugin.
pub fn factory() -> impl Iterator<Item = Preset> {
    FACTORY.iter().map(|(name, bytes)| Preset {
        name: (*name).to_owned(),
        file: None,
        about: file::about(bytes),
        scene: scene_of(bytes),
    })
}

/// The user's preset in a file; none where the file has another extension or is a copy of a factory preset.
pub fn of_file(path: &Path) -> Option<Preset> {
    let name = path.file_stem()?.to_str().filter(|_| path.extension().is_some_and(|e| e == EXTENSION))?;
    // Of what cannot be read, the error is for who chooses it.
    let bytes = read_limited(path, LARGEST_FILE).unwrap_or_default();
    let about = file::about(&bytes);
    let is_copy = about.is_factory && FACTORY.iter().any(|(known, _)| *known == name);
    (!is_copy).then(|| Preset { name: name.to_owned(), file: Some(path.to_owned()), about, scene: scene_of(&bytes) })
}

/// The scene's file that the preset in a file's bytes plays.
fn scene_of(bytes: &[u8]) -> Option<SceneKey> {
    let state = file::state(bytes, FACTORY[0].1).ok()?;
    let plays_file = matches!(state.params.get("scene"), Some(ParamValue::String(id)) if id == "library");
    let scene = serde_json::from_str::<SceneKey>(state.fields.get("scene")?).ok()?;
    Some(scene).filter(|scene| plays_file && scene.is_some())
}

/// The state in a preset.
///
/// # Errors
/// The file cannot be read or is not a preset of this plugin.
pub fn read(preset: &Preset) -> Result<PluginState, Fault> {
    match &preset.file {
        Some(path) => read_file(path),
        None => read_factory(&preset.name),
    }
}

/// The state in a preset's file.
///
/// # Errors
/// The file cannot be read or is not a preset of this plugin.
pub fn read_file(path: &Path) -> Result<PluginState, Fault> {
    let bytes = read_limited(path, LARGEST_FILE).map_err(Fault::read(path))?;
    state_in(&bytes, &path.display().to_string())
}

/// The state in a factory preset.
///
/// # Errors
/// There is none of that name.
pub fn read_factory(name: &str) -> Result<PluginState, Fault> {
    let known = FACTORY.iter().find(|(known, _)| *known == name);
    let none = || Fault::argument(name, PRESET, "no factory preset of that name");
    state_in(known.ok_or_else(none)?.1, name)
}

/// Saves a state under a name in the user's folder, and replaces a preset of that name.
///
/// # Errors
/// The name cannot be a file name, or the file cannot be written.
pub fn save(folder: &Path, name: &str, state: &PluginState) -> Result<Preset, Fault> {
    let no_name = || Fault::argument("name of a preset", "a file name without separators", format_args!("{:?}", name.trim()));
    let name = file_name_of(name).ok_or_else(no_name)?;
    let path = folder.join(format!("{name}.{EXTENSION}"));
    let io_error = Fault::write(&path);
    std::fs::create_dir_all(folder).map_err(&io_error)?;
    // Those belong to the project that it was made in.
    let mut state = serde_json::to_value(state).map_err(|error| io_error(io::Error::other(error)))?;
    if let Some(fields) = state["fields"].as_object_mut() {
        fields.retain(|name, _| name != "project" && name != "leader");
    }
    let json = serde_json::to_vec(&state).map_err(|error| io_error(io::Error::other(error)))?;
    write_whole(&path, &file::write(&json, FACTORY[0].1)).map_err(io_error)?;
    Ok(Preset { name: name.to_owned(), file: Some(path), about: About::default(), scene: None })
}

fn state_in(bytes: &[u8], what: &str) -> Result<PluginState, Fault> {
    file::state(bytes, FACTORY[0].1).map_err(|found| Fault::argument(what, PRESET, found))
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_user_preset_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let mut state = read(&list(None)[0]).unwrap();
        state.params.insert("x".to_owned(), ParamValue::F32(-2.25));
        let saved = save(folder.path(), " Mine ", &state).unwrap();
        let listed = list(Some(folder.path()));
        assert_eq!(listed.last().map(|preset| (&preset.name, &preset.file)), Some((&saved.name, &saved.file)));
        assert_eq!(saved.name, "Mine");
        let json = |state: &PluginState| serde_json::to_string(state).unwrap();
        assert_eq!(json(&read(&saved).unwrap()), json(&state));
    }

    #[test]
    fn names_that_are_paths_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let state = read(&list(None)[0]).unwrap();
        for name in ["", " ", "../x", "a/b", ".hidden", "C:x", ".."] {
            let error = save(folder.path(), name, &state).unwrap_err().to_string();
            assert!(error.contains("name of a preset: expected"), "{name}: {error}");
        }
    }

    #[test]
    fn every_factory_preset_says_what_it_is_for_and_plays_a_scene_that_is_installed() {
        const USES: [&str; 4] = ["speech", "music", "film", "walk"];
        let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("../presets/library");
        for Preset { name, about, file, scene: of } in factory() {
            assert!(about.is_factory && about.sentence.ends_with('.'), "{name}: {about:?}");
            assert!(!about.uses.is_empty() && about.uses.iter().all(|word| USES.contains(&word.as_str())), "{name}: {about:?}");
            let state = read(&Preset { name: name.clone(), about, file, scene: None }).unwrap();
            let scene: SceneKey = serde_json::from_str(&state.fields["scene"]).unwrap();
            assert_eq!(of.is_some(), scene.is_some(), "{name}");
            if scene.is_loft() {
                continue;
            }
            assert!(!scene.is_some() || library.join(scene.file_name()).is_file(), "{name}: {scene:?}");
            let level = crate::library::factory::place(scene.file_name());
            assert_eq!(level.is_some(), scene.is_some(), "{name} would play its dry track at its own level without its place");
        }
        for wanted in USES {
            assert!(factory().any(|preset| preset.about.uses.iter().any(|word| word == wanted)), "{wanted}");
        }
    }

    #[test]
    fn copies_of_factory_presets_are_listed_once() {
        let folder = tempfile::tempdir().unwrap();
        let (name, bytes) = FACTORY[0];
        std::fs::write(folder.path().join(format!("{name}.{EXTENSION}")), bytes).unwrap();
        assert_eq!(list(Some(folder.path())), list(None));
        // Under another name, or changed by the user, it is the user's.
        std::fs::write(folder.path().join(format!("Another.{EXTENSION}")), bytes).unwrap();
        save(folder.path(), name, &read(&list(None)[0]).unwrap()).unwrap();
        let users = list(Some(folder.path())).split_off(FACTORY.len());
        assert_eq!(users.iter().map(|preset| preset.name.as_str()).collect::<Vec<_>>(), ["Another", name]);
    }

    #[test]
    fn an_error_names_the_file() {
        let error = state_in(&FACTORY[0].1[..100], "some.vstpreset").unwrap_err();
        assert!(error.to_string().starts_with("some.vstpreset: expected a preset of Promenade"), "{error}");
    }
}
