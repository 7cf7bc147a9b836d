//! Files and folders with plugins.

use crate::backend::Backend;
use crate::clap::{self, ClapPlugin};
use crate::info::{Format, PluginInfo};
use crate::instance::Instance;
use crate::preset::{self, Preset};
use crate::setup::Setup;
use crate::vst3::{self, Module, Vst3Plugin};
use crate::{Fault, error};
use clack_host::prelude::PluginEntry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file or folder with plugins, loaded once for all instances, and for as long as the process lives.
pub struct Bundle {
    path: PathBuf,
    plugins: Vec<PluginInfo>,
    inner: Inner,
}

enum Inner {
    Clap(PluginEntry),
    Vst3(Arc<Module>),
}

impl Bundle {
    /// Loads a plugin whose name ends in `.clap` or `.vst3`, and runs its code.
    ///
    /// # Errors
    /// Another name; a file that is missing, no plugin, made for another system, or without a plugin in it.
    pub fn load(path: &Path) -> Result<Self, Fault> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("clap") => Self::load_as(path, Format::Clap),
            Some("vst3") => Self::load_as(path, Format::Vst3),
            _ => Err(Fault::new(format!("{}: expected a plugin whose name ends in .clap or .vst3", path.display()))),
        }
    }

    /// Loads a plugin whatever its name.
    ///
    /// # Errors
    /// What [`Bundle::load`] refuses, but for the name.
    pub fn load_as(path: &Path, format: Format) -> Result<Self, Fault> {
        // A name without a folder would be looked for among the system's libraries.
        let path = std::path::absolute(path).map_err(|e| error::unloaded(path, e))?;
        if !path.exists() {
            return Err(error::unloaded(&path, "there is no such file"));
        }
        let (plugins, inner) = match format {
            Format::Clap => {
                let entry = clap::load(&path)?;
                (clap::plugins(&entry), Inner::Clap(entry))
            }
            Format::Vst3 => {
                let plugins = vst3::plugins(&path)?;
                let module = Module::open(&path).map_err(|e| error::unloaded(&path, e))?;
                (plugins, Inner::Vst3(Arc::new(module)))
            }
        };
        if plugins.is_empty() {
            return Err(error::unloaded(&path, "it lists no plugin"));
        }
        Ok(Self { path, plugins, inner })
    }

    /// A bundle of plugins that this program contains.
    #[cfg(test)]
    pub(crate) fn of_clap(entry: PluginEntry) -> Self {
        Self { path: PathBuf::from("inside.clap"), plugins: clap::plugins(&entry), inner: Inner::Clap(entry) }
    }

    /// The file or folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The format.
    #[must_use]
    pub fn format(&self) -> Format {
        match &self.inner {
            Inner::Clap(_) => Format::Clap,
            Inner::Vst3(_) => Format::Vst3,
        }
    }

    /// The plugins in it, at least one.
    #[must_use]
    pub fn plugins(&self) -> &[PluginInfo] {
        &self.plugins
    }

    /// Opens an instance of the first plugin.
    ///
    /// # Errors
    /// A setup out of range; a plugin that cannot be made or activated, or whose channels are not those of a track.
    pub fn open(&self, setup: Setup) -> Result<Instance, Fault> {
        self.open_plugin(&self.plugins()[0], setup)
    }

    /// The plugin of a name or id.
    ///
    /// # Errors
    /// The bundle has no such plugin.
    pub fn find(&self, wanted: &str) -> Result<&PluginInfo, Fault> {
        let found = self.plugins().iter().find(|p| p.id == wanted || p.name == wanted);
        found.ok_or_else(|| {
            let names = self.plugins().iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
            Fault::content(&self.path, format_args!("a plugin {wanted:?}"), names)
        })
    }

    /// What a host's browser is told of a plugin's presets, and what is wrong with files that should be some. A CLAP plugin
    /// lists them; those of VST3 plugins are files in folders that the format names.
    ///
    /// # Errors
    /// The plugin lists presets but fails to.
    pub fn presets(&self, plugin: &PluginInfo) -> Result<(Vec<Preset>, Vec<String>), Fault> {
        match &self.inner {
            Inner::Clap(entry) => clap::presets(entry, &self.path, &plugin.id),
            Inner::Vst3(_) => Ok((vst3::presets(plugin), Vec::new())),
        }
    }

    /// The preset of a plugin by its name.
    ///
    /// # Errors
    /// The plugin lists presets but fails to, or there is none of that name.
    pub fn preset(&self, plugin: &PluginInfo, wanted: &str) -> Result<Preset, Fault> {
        preset::find(&self.presets(plugin)?.0, wanted, &plugin.name).cloned()
    }

    /// Opens an instance of one of [`Bundle::plugins`].
    ///
    /// # Errors
    /// What [`Bundle::open`] refuses, or the plugin is not of this bundle.
    pub fn open_plugin(&self, plugin: &PluginInfo, setup: Setup) -> Result<Instance, Fault> {
        setup.check()?;
        let backend: Box<dyn Backend> = match &self.inner {
            Inner::Clap(entry) => Box::new(ClapPlugin::open(entry, &self.path, plugin, setup)?),
            Inner::Vst3(module) => Box::new(Vst3Plugin::open(module, &self.path, plugin, setup)?),
        };
        Instance::new(backend, setup)
    }
}
