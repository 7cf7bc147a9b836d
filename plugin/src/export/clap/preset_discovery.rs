//! What a CLAP host's browser is told of presets: the factory's inside the plugin, the user's in their folder, and the
//! library's scenes.

use crate::export::{Promenade, kind::KINDS};
use crate::history::presets::{self, About, EXTENSION, Preset};
use crate::library::{self, lister};
use clack_extensions::preset_discovery::factory::PresetDiscoveryFactory;
use clack_extensions::preset_discovery::prelude::*;
use clack_plugin::prelude::PluginError;
use nice_plug::prelude::Plugin;
use std::ffi::{CStr, CString, c_void};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// The id of the only provider.
const PROVIDER: &str = "audio.promenade.presets";

static FACTORY: LazyLock<PresetDiscoveryFactoryWrapper<Providers>> = LazyLock::new(|| {
    let descriptor = ProviderDescriptor::new(PROVIDER, <Promenade>::NAME).with_vendor(<Promenade>::VENDOR);
    PresetDiscoveryFactoryWrapper::new(Providers { descriptor })
});

/// The factory, if it is asked for by one of its names.
pub(super) fn factory(id: &CStr) -> Option<*const c_void> {
    use clack_plugin::factory::{Factory, FactoryImplementation};
    PresetDiscoveryFactory::IDENTIFIERS.contains(&id).then(|| FACTORY.wrapper().as_raw_ptr().cast())
}

struct Providers {
    descriptor: ProviderDescriptor,
}

impl PresetDiscoveryFactoryImpl for Providers {
    fn provider_count(&self) -> u32 {
        1
    }

    fn provider_descriptor(&self, index: u32) -> Option<&ProviderDescriptor> {
        (index == 0).then_some(&self.descriptor)
    }

    fn create_provider<'a>(&'a self, indexer: IndexerInfo<'a>, id: &CStr) -> Option<ProviderInstance<'a>> {
        let known = Some(id) == self.descriptor.id();
        known.then(|| ProviderInstance::new(indexer, &self.descriptor, Provider::new))
    }
}

struct Provider;

impl Provider {
    /// Tells the host where to look: in folders that are there, because hosts take others for a fault.
    fn new(mut indexer: Indexer<'_>) -> Result<Self, PluginError> {
        for (name, extension) in [(c"Promenade preset", EXTENSION), (c"Promenade scene", library::SCENES[0])] {
            let extension = CString::new(extension)?;
            indexer.declare_filetype(FileType { name, description: None, file_extension: Some(&extension) })?;
        }
        let factory = LocationInfo { name: c"Factory", flags: Flags::IS_FACTORY_CONTENT, location: Location::Plugin };
        indexer.declare_location(factory)?;
        let folder = |name, flags, path: PathBuf| (name, flags, path);
        let users = presets::folder().map(|path| folder(c"User presets", Flags::IS_USER_CONTENT, path));
        let scenes = library::folders().into_iter().map(|path| folder(c"Scene library", Flags::empty(), path));
        for (name, flags, path) in users.into_iter().chain(scenes).filter(|(.., path)| path.is_dir()) {
            let path = text(&path.to_string_lossy());
            indexer.declare_location(LocationInfo { name, flags, location: Location::File { path: &path } })?;
        }
        Ok(Self)
    }
}

impl ProviderImpl<'_> for Provider {
    fn get_metadata(&mut self, location: Location, receiver: &mut MetadataReceiver) -> Result<(), PluginError> {
        let Some(path) = location.file_path() else {
            for Preset { name, about, .. } in presets::factory() {
                describe(receiver, &name, Some(&name), &about)?;
            }
            return Ok(());
        };
        let path = PathBuf::from(path.to_str()?);
        if path.extension().is_some_and(|extension| extension == EXTENSION) {
            // Copies of factory presets are listed by those.
            return presets::of_file(&path).map_or(Ok(()), |preset| describe(receiver, &preset.name, None, &preset.about));
        }
        let (name, about) = about_scene(&path)?;
        describe(receiver, &name, None, &about)
    }
}

/// The title of a scene, and what its file says of it.
fn about_scene(path: &Path) -> Result<(String, About), PluginError> {
    let card = lister::card_at(path).map_err(|reason| PluginError::Error(format!("{}: {reason}", path.display()).into()))?;
    let title = card.provenance.title;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let sentence = format!("Plays the scene {}.", path.file_name().unwrap_or_default().to_string_lossy());
    let about = About { sentence, uses: vec!["scene".to_owned()], is_factory: false };
    Ok((if title.is_empty() { name } else { title }, about))
}

fn describe(receiver: &mut MetadataReceiver, name: &str, key: Option<&str>, about: &About) -> Result<(), PluginError> {
    let key = key.map(text);
    let preset = receiver.begin_preset(Some(&text(name)), key.as_deref())?;
    for kind in &KINDS {
        preset.add_plugin_id(UniversalPluginId::clap(&text(kind.clap_id)));
    }
    if about.is_factory {
        preset.set_flags(Flags::IS_FACTORY_CONTENT).add_creator(&text(<Promenade>::VENDOR));
    }
    if !about.sentence.is_empty() {
        preset.set_description(&text(&about.sentence));
    }
    for word in &about.uses {
        preset.add_feature(&text(word));
    }
    Ok(())
}

/// A text for C; nothing after a zero within it.
fn text(words: &str) -> CString {
    let end = words.find('\0').unwrap_or(words.len());
    CString::new(&words[..end]).unwrap_or_default()
}
