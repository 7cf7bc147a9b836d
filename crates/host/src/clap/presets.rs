//! What a CLAP library tells a host's browser of its presets.

use super::owned;
use crate::preset::{Preset, PresetPlace};
use crate::{Fault, error};
use clack_extensions::preset_discovery::prelude::*;
use clack_host::prelude::{HostError as Refusal, HostInfo, PluginEntry};
use std::collections::BTreeSet;
use std::ffi::{CStr, CString};
use std::path::{Path, PathBuf};

/// More files than any folder of presets has.
const MOST_FILES: usize = 100_000;
/// Folders within folders are followed so deep.
const DEEPEST: usize = 8;

/// Where a provider says that presets are.
#[derive(Default)]
struct Indexer {
    /// Endings of names without the dot; with none any file may be a preset's.
    extensions: Vec<String>,
    locations: Vec<Declared>,
}

#[derive(Clone)]
struct Declared {
    name: String,
    is_factory: bool,
    /// `None` for the plugin itself.
    path: Option<PathBuf>,
}

impl IndexerImpl for Indexer {
    fn declare_filetype(&mut self, file_type: FileType) -> Result<(), Refusal> {
        self.extensions.extend(file_type.file_extension.map(|extension| owned(Some(extension))));
        Ok(())
    }

    fn declare_location(&mut self, info: LocationInfo) -> Result<(), Refusal> {
        let is_factory = info.flags.contains(Flags::IS_FACTORY_CONTENT);
        let path = info.location.file_path().map(|path| PathBuf::from(owned(Some(path))));
        if path.as_ref().is_some_and(|path| !path.is_absolute()) {
            return Err(Refusal::Message("expected an absolute path"));
        }
        self.locations.push(Declared { name: owned(Some(info.name)), is_factory, path });
        Ok(())
    }

    fn declare_soundpack(&mut self, _soundpack: Soundpack) -> Result<(), Refusal> {
        Ok(())
    }
}

/// What is said of the presets of one place.
struct PresetReceiver {
    template: Preset,
    /// Each with the ids of the plugins that it is for.
    presets: Vec<(Preset, Vec<String>)>,
    error: Option<String>,
}

impl PresetReceiver {
    fn last(&mut self) -> Option<&mut Preset> {
        self.presets.last_mut().map(|(preset, _)| preset)
    }
}

impl MetadataReceiverImpl for PresetReceiver {
    fn on_error(&mut self, _code: i32, message: Option<&CStr>) {
        self.error = Some(owned(message));
    }

    fn begin_preset(&mut self, name: Option<&CStr>, load_key: Option<&CStr>) -> Result<(), Refusal> {
        let mut preset = self.template.clone();
        if let Some(name) = name {
            preset.name = owned(Some(name));
        }
        preset.key = load_key.map(|key| owned(Some(key)));
        self.presets.push((preset, Vec::new()));
        Ok(())
    }

    fn add_plugin_id(&mut self, id: UniversalPluginId) {
        if let Some((_, ids)) = self.presets.last_mut().filter(|_| id.abi == c"clap") {
            ids.push(owned(Some(id.id)));
        }
    }

    fn set_soundpack_id(&mut self, _id: &CStr) {}

    fn set_flags(&mut self, flags: Flags) {
        if let Some(preset) = self.last() {
            preset.is_factory = flags.contains(Flags::IS_FACTORY_CONTENT);
        }
    }

    fn add_creator(&mut self, creator: &CStr) {
        if let Some(preset) = self.last() {
            preset.creators.push(owned(Some(creator)));
        }
    }

    fn set_description(&mut self, description: &CStr) {
        if let Some(preset) = self.last() {
            preset.description = owned(Some(description));
        }
    }

    fn set_timestamps(&mut self, _created: Option<Timestamp>, _changed: Option<Timestamp>) {}

    fn add_feature(&mut self, feature: &CStr) {
        if let Some(preset) = self.last() {
            preset.features.push(owned(Some(feature)));
        }
    }

    fn add_extra_info(&mut self, _key: &CStr, _value: &CStr) {}
}

/// The presets of a plugin, place by place, and what is wrong with files that are none.
pub(crate) fn of(entry: &PluginEntry, path: &Path, plugin: &str) -> Result<(Vec<Preset>, Vec<String>), Fault> {
    let failed = |reason: String| error::unloaded(path, format!("its presets cannot be listed: {reason}"));
    let info = super::host_info().map_err(|e| failed(e.to_string()))?;
    let Some(factory) = entry.get_factory::<PresetDiscoveryFactory>() else { return Ok(Default::default()) };
    let (mut all, mut wrong) = (Vec::new(), Vec::new());
    for id in factory.provider_descriptors().filter_map(ProviderDescriptor::id) {
        list(entry, &info, id, plugin, &mut all, &mut wrong).map_err(|e| failed(e.to_string()))?;
    }
    Ok((all, wrong))
}

/// What one provider declares.
fn list(
    entry: &PluginEntry,
    info: &HostInfo,
    id: &CStr,
    plugin: &str,
    all: &mut Vec<Preset>,
    wrong: &mut Vec<String>,
) -> Result<(), clack_extensions::preset_discovery::provider::ProviderInstanceError> {
    let mut provider = Provider::instantiate(Indexer::default(), entry, id, info)?;
    let extensions = provider.indexer().extensions.clone();
    for Declared { name, is_factory, path } in provider.indexer().locations.clone() {
        let places: Vec<_> = match path {
            None => vec![PresetPlace::Plugin],
            Some(path) => files(&path, &extensions).into_iter().map(PresetPlace::File).collect(),
        };
        for place in places {
            let (file, title) = match &place {
                PresetPlace::Plugin => (None, String::new()),
                PresetPlace::File(path) => {
                    let title = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                    (CString::new(path.to_string_lossy().as_bytes()).ok(), title)
                }
            };
            let location = file.as_ref().map_or(Location::Plugin, |path| Location::File { path });
            let template = Preset {
                name: title.clone(),
                place: place.clone(),
                key: None,
                folder: name.clone(),
                description: String::new(),
                features: Vec::new(),
                creators: Vec::new(),
                is_factory,
            };
            let mut receiver = PresetReceiver { template, presets: Vec::new(), error: None };
            provider.get_metadata(location, &mut receiver);
            wrong.extend(receiver.error);
            let ours = receiver.presets.into_iter().filter(|(_, ids)| ids.iter().any(|id| id == plugin));
            all.extend(ours.map(|(preset, _)| preset));
        }
    }
    Ok(())
}

/// A file, or the files in a folder and its folders, in order of their paths.
fn files(path: &Path, extensions: &[String]) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    collect(path, extensions, DEEPEST, &mut found);
    found
}

fn collect(path: &Path, extensions: &[String], depth: usize, found: &mut BTreeSet<PathBuf>) {
    if path.is_dir() && depth > 0 {
        for entry in std::fs::read_dir(path).into_iter().flatten().flatten() {
            collect(&entry.path(), extensions, depth - 1, found);
        }
        return;
    }
    let named = path.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    if path.is_file() && found.len() < MOST_FILES && (extensions.is_empty() || extensions.contains(&named)) {
        found.insert(path.to_owned());
    }
}
