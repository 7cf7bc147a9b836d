//! What can go wrong with somebody else's plugin.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a plugin cannot be loaded, set or played.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HostError {
    /// The name has neither format's extension.
    #[error("{path}: expected a plugin whose name ends in .clap or .vst3", path = path.display())]
    Format {
        /// What was to be loaded.
        path: PathBuf,
    },
    /// The file is not there, is no plugin, or refuses to be loaded.
    #[error("{path}: cannot be loaded: {reason}", path = path.display())]
    Load {
        /// What was to be loaded.
        path: PathBuf,
        /// The loader's message.
        reason: String,
    },
    /// The bundle has no plugin of that name or id.
    #[error("{path}: expected a plugin {wanted:?}, found {found}", path = path.display())]
    NoSuchPlugin {
        /// The bundle.
        path: PathBuf,
        /// The name or id that was asked for.
        wanted: String,
        /// Names of the plugins that are there.
        found: String,
    },
    /// A setup, block or value that no host would hand to a plugin.
    #[error("expected {expected}, found {found}")]
    Unusable {
        /// What is allowed.
        expected: String,
        /// What was given.
        found: String,
    },
    /// The plugin's inputs and outputs are not those of a track.
    #[error("{plugin}: expected {expected}, found {found}")]
    Layout {
        /// Name of the plugin.
        plugin: String,
        /// Channels that this host can connect.
        expected: String,
        /// Channels that the plugin has.
        found: String,
    },
    /// There is no parameter of that name or number.
    #[error("{plugin}: expected one of its {count} parameters, found {wanted:?}{hint}")]
    NoSuchParameter {
        /// Name of the plugin.
        plugin: String,
        /// How many there are.
        count: usize,
        /// The name or number that was asked for.
        wanted: String,
        /// The closest name, or that several share this one.
        hint: String,
    },
    /// There is no preset of that name.
    #[error("{plugin}: expected one of its {count} presets, found {wanted:?}{hint}")]
    NoSuchPreset {
        /// Name of the plugin.
        plugin: String,
        /// How many there are.
        count: usize,
        /// The name that was asked for.
        wanted: String,
        /// The closest name.
        hint: String,
    },
    /// The plugin makes nothing of a text.
    #[error("parameter {parameter:?}: expected a value that {plugin} understands, such as {example:?}, found {found:?}")]
    Value {
        /// Name of the plugin.
        plugin: String,
        /// Name of the parameter.
        parameter: String,
        /// The default, as the plugin writes it.
        example: String,
        /// The text that was given.
        found: String,
    },
    /// The plugin does not do something that not all plugins do.
    #[error("{plugin} has no {what}")]
    Missing {
        /// Name of the plugin.
        plugin: String,
        /// What it lacks.
        what: &'static str,
    },
    /// The plugin fails in something that it should do.
    #[error("{plugin} fails to {what}: {reason}")]
    Failed {
        /// Name of the plugin.
        plugin: String,
        /// What it was asked to do.
        what: &'static str,
        /// What is known about it.
        reason: String,
    },
}

impl HostError {
    pub(crate) fn load(path: &Path, reason: impl ToString) -> Self {
        Self::Load { path: path.to_path_buf(), reason: reason.to_string() }
    }

    pub(crate) fn unusable(expected: impl Into<String>, found: impl ToString) -> Self {
        Self::Unusable { expected: expected.into(), found: found.to_string() }
    }
}
