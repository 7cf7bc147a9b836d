//! Files and folders with plugins.

use crate::HostError;
use crate::backend::Backend;
use crate::clap::ClapBundle;
use crate::info::{Format, PluginInfo};
use crate::instance::Instance;
use crate::setup::Setup;
use crate::vst3::Vst3Bundle;
use std::fmt;
use std::path::{Path, PathBuf};

/// A file or folder with plugins, loaded once for all instances, and for as long as the process lives.
pub struct Bundle {
    path: PathBuf,
    inner: Inner,
}

enum Inner {
    Clap(ClapBundle),
    Vst3(Vst3Bundle),
}

impl fmt::Debug for Bundle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bundle").field("path", &self.path).field("format", &self.format()).finish_non_exhaustive()
    }
}

impl Bundle {
    /// Loads a plugin whose name ends in `.clap` or `.vst3`, and runs its code.
    ///
    /// # Errors
    /// Another name; a file that is missing, no plugin, made for another system, or without a plugin in it.
    pub fn load(path: &Path) -> Result<Self, HostError> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("clap") => Self::load_as(path, Format::Clap),
            Some("vst3") => Self::load_as(path, Format::Vst3),
            _ => Err(HostError::Format { path: path.to_path_buf() }),
        }
    }

    /// Loads a plugin whatever its name.
    ///
    /// # Errors
    /// As [`Bundle::load`].
    pub fn load_as(path: &Path, format: Format) -> Result<Self, HostError> {
        // A name without a folder would be looked for among the system's libraries.
        let absolute = std::path::absolute(path);
        let path = absolute.map_err(|e| HostError::Load { path: path.to_path_buf(), reason: e.to_string() })?;
        let inner = match format {
            Format::Clap => Inner::Clap(ClapBundle::load(&path)?),
            Format::Vst3 => Inner::Vst3(Vst3Bundle::load(&path)?),
        };
        Ok(Self { path, inner })
    }

    /// A bundle of plugins that this program contains.
    #[cfg(test)]
    pub(crate) fn of_clap(bundle: ClapBundle) -> Self {
        Self { path: PathBuf::from("inside.clap"), inner: Inner::Clap(bundle) }
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
        match &self.inner {
            Inner::Clap(bundle) => bundle.plugins(),
            Inner::Vst3(bundle) => bundle.plugins(),
        }
    }

    /// Opens an instance of the first plugin.
    ///
    /// # Errors
    /// A setup out of range; a plugin that cannot be made or activated, or whose channels are not those of a track.
    pub fn open(&self, setup: Setup) -> Result<Instance, HostError> {
        self.open_plugin(&self.plugins()[0], setup)
    }

    /// The plugin of a name or id.
    ///
    /// # Errors
    /// The bundle has no such plugin.
    pub fn find(&self, wanted: &str) -> Result<&PluginInfo, HostError> {
        let found = self.plugins().iter().find(|p| p.id == wanted || p.name == wanted);
        found.ok_or_else(|| HostError::NoSuchPlugin {
            path: self.path.clone(),
            wanted: wanted.to_owned(),
            found: self.plugins().iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// Opens an instance of one of [`Bundle::plugins`].
    ///
    /// # Errors
    /// As [`Bundle::open`], or the plugin is not of this bundle.
    pub fn open_plugin(&self, plugin: &PluginInfo, setup: Setup) -> Result<Instance, HostError> {
        setup.check()?;
        let backend: Box<dyn Backend> = match &self.inner {
            Inner::Clap(bundle) => Box::new(bundle.open(&self.path, plugin, setup)?),
            Inner::Vst3(bundle) => Box::new(bundle.open(&self.path, plugin, setup)?),
        };
        Instance::new(backend, setup)
    }
}
