//! Promenade as a plugin: parameters, state, scene loading and the shell around [`promenade_core::Spatializer`].
//!
//! Threads: the audio thread owns [`Promenade`] and calls `process` and `reset`; everything that reads a file, parses or allocates is
//! done by the [`loader`] on the host's main thread or on a background thread; a second one decodes poses. All instances in a process share both.

pub mod attention;
pub mod cache;
pub mod causes;
pub mod clock;
pub mod decoder;
pub mod editor;
mod export;
pub mod factory;
pub mod group;
pub mod kept;
pub mod library;
pub mod listener;
pub mod lister;
pub mod loader;
pub mod osc;
pub mod pace;
pub mod params;
#[cfg(feature = "standalone")]
pub mod player;
mod plugin;
pub mod pose_cell;
pub mod presets;
pub mod recall;
pub mod reference;
pub mod remote;
pub mod settings;
pub mod state;
pub mod telemetry;
pub mod walk;
pub mod worker;

pub use plugin::Promenade;
