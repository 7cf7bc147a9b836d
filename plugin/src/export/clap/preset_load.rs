//! Presets that a CLAP host's browser loads: `clap.preset-load`, which the framework lacks.
//!
//! A preset is merged into the state that the framework saves, and the whole is restored: what presets do not set stays as it
//! is.

use super::{host_extension, state};
use crate::export::guard::guard;
use crate::history::{presets, user_state::UserState};
use crate::library::{self, SCENES, scene_key::SceneKey};
use crate::project::params::PromenadeParams;
use clap_sys::ext::preset_load::{
    CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT, clap_host_preset_load, clap_plugin_preset_load,
};
use clap_sys::factory::preset_discovery::{CLAP_PRESET_DISCOVERY_LOCATION_FILE, CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN};
use nice_plug::wrapper::clap::clap_plugin;
use promenade_fault::{Fault, with_causes};
use std::ffi::{CStr, CString, c_char};
use std::path::PathBuf;

/// Names of the extension, the present one first.
pub(super) const IDS: [&CStr; 2] = [CLAP_EXT_PRESET_LOAD, CLAP_EXT_PRESET_LOAD_COMPAT];

/// The extension.
pub(super) static EXTENSION: clap_plugin_preset_load = clap_plugin_preset_load { from_location: Some(from_location) };

/// Where a preset is.
enum Place {
    /// Inside the plugin, by its name.
    Plugin(String),
    /// A preset's or a scene's file.
    File(PathBuf),
}

unsafe extern "C" fn from_location(
    plugin: *const clap_plugin,
    kind: u32,
    location: *const c_char,
    load_key: *const c_char,
) -> bool {
    // SAFETY: texts end with a zero, or are not there.
    let text = |text: *const c_char| (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned());
    let place = match kind {
        CLAP_PRESET_DISCOVERY_LOCATION_PLUGIN => text(load_key).map(Place::Plugin),
        CLAP_PRESET_DISCOVERY_LOCATION_FILE => text(location).map(|path| Place::File(path.into())),
        _ => None,
    };
    let no_place = || Fault::unexpected("a file, or the name of a factory preset", "neither");
    let loaded = guard(Err(no_state()), || load(plugin, &place.ok_or_else(no_place)?));
    let (host, theirs) = host_extension::<clap_host_preset_load>(plugin, &IDS).unzip();
    match loaded {
        Ok(()) => {
            if let (Some(host), Some(loaded)) = (host, theirs.and_then(|theirs| theirs.loaded)) {
                // SAFETY: the host is alive, and the arguments are its own.
                unsafe { loaded(host, kind, location, load_key) };
            }
            true
        }
        Err(error) => {
            let words = with_causes(&error);
            nice_plug::nice_error!("a preset cannot be loaded: {words}");
            let words = CString::new(words).unwrap_or_default();
            if let (Some(host), Some(on_error)) = (host, theirs.and_then(|theirs| theirs.on_error)) {
                // SAFETY: as above.
                unsafe { on_error(host, kind, location, load_key, 0, words.as_ptr()) };
            }
            false
        }
    }
}

fn no_state() -> Fault {
    Fault::new("the plugin's state cannot be taken over")
}

/// Restores a preset, or plays a scene from where its makers let the listener begin.
fn load(plugin: *const clap_plugin, place: &Place) -> Result<(), Fault> {
    let mut saved = state::save(plugin).ok_or_else(no_state)?;
    let now = UserState::from_saved(saved.clone(), &UserState::of(&PromenadeParams::default()));
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|e| SCENES.iter().any(|scene| e == *scene));
    // Held until the instance has it, so that it is read once.
    let mut held = None;
    let wanted = match place {
        Place::File(path) if is_scene(path) => {
            let (scene, hash) = library::scene_at(path)?;
            let key = SceneKey::to_file(path, hash, scene.title().to_owned(), 0);
            let start = scene.start_pose();
            held = Some(scene);
            now.in_scene(key, start)
        }
        Place::File(path) => UserState::from_saved(presets::read_file(path)?, &now),
        Place::Plugin(name) => UserState::from_saved(presets::read_factory(name)?, &now),
    };
    let restored = wanted.put_into(&mut saved).is_ok() && state::load(plugin, &saved);
    drop(held);
    restored.then_some(()).ok_or_else(no_state)
}
