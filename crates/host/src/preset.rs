//! Presets as a plugin lists them for a host's browser.

use crate::Fault;
use crate::error::no_such;
use std::path::PathBuf;

/// Where a preset is.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PresetPlace {
    /// Inside the plugin.
    Plugin,
    /// In a file.
    File(PathBuf),
}

/// A preset as a host's browser shows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub place: PresetPlace,
    /// Which one it is where its place holds several.
    pub key: Option<String>,
    /// What the plugin calls the place, such as "Factory"; of VST3 plugins the folder.
    pub folder: String,
    /// A sentence, empty where none is given.
    pub description: String,
    /// What it is for or like, in words that plugins choose.
    pub features: Vec<String>,
    /// Who made it.
    pub creators: Vec<String>,
    /// Whether it came with the plugin.
    pub is_factory: bool,
}

/// The preset of a name.
pub(crate) fn find<'a>(presets: &'a [Preset], wanted: &str, plugin: &str) -> Result<&'a Preset, Fault> {
    let alike = || presets.iter().find(|preset| preset.name.eq_ignore_ascii_case(wanted.trim()));
    presets.iter().find(|preset| preset.name == wanted).ok_or_else(|| {
        let hint = alike().map_or_else(String::new, |preset| format!("; did you mean {:?}?", preset.name));
        no_such(plugin, (presets.len(), "presets"), wanted, &hint)
    })
}
