//! Presets of VST3 plugins: files in folders that the format names.

use crate::info::PluginInfo;
use crate::preset::{Preset, PresetPlace};
use std::path::PathBuf;

/// The folders of all plugins' presets, the user's first.
///
/// Source: VST 3 SDK documentation, "Preset locations".
fn roots() -> Vec<PathBuf> {
    let home = |path: &str| dirs::home_dir().map(|home| home.join(path));
    if cfg!(target_os = "windows") {
        dirs::document_dir().map(|documents| documents.join("VST3 Presets")).into_iter().collect()
    } else if cfg!(target_os = "macos") {
        home("Library/Audio/Presets").into_iter().chain(["/Library/Audio/Presets".into()]).collect()
    } else {
        let system = ["/usr/share/vst3/presets", "/usr/local/share/vst3/presets"].map(PathBuf::from);
        home(".vst3/presets").into_iter().chain(system).collect()
    }
}

/// The presets of a plugin, folder by folder, each sorted by name.
pub(crate) fn of(plugin: &PluginInfo) -> Vec<Preset> {
    let mut all = Vec::new();
    for folder in roots().into_iter().map(|root| root.join(&plugin.vendor).join(&plugin.name)) {
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let mut here: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "vstpreset")).collect();
        here.sort();
        all.extend(here.into_iter().map(|path| Preset {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            place: PresetPlace::File(path),
            key: None,
            folder: folder.display().to_string(),
            description: String::new(),
            features: Vec::new(),
            creators: Vec::new(),
            is_factory: false,
        }));
    }
    all
}
