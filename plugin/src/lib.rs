//! Promenade as a plugin: parameters, state, scene loading and the shell around [`promenade_core::Spatializer`].
//!
//! Threads: the audio thread owns [`Promenade`] and calls `process` and `reset`. Whatever reads a file, parses or allocates is done by the
//! [`loader`] on the host's main thread or on a background thread; another background thread decodes poses. All instances in a process share
//! these threads.

#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

pub mod attention;
pub mod budget;
pub mod cache;
mod cast;
pub mod choices;
pub mod clock;
pub mod drawn_room;
pub mod editor;
pub mod error_chain;
mod export;
pub mod factory;
pub mod file_wish;
pub mod flag;
pub mod group;
#[cfg(test)]
mod head_tests;
#[cfg(test)]
mod headphones_tests;
pub mod history;
pub mod host_side;
pub mod library;
pub mod limit;
pub mod listener;
pub mod lister;
pub mod loader;
mod lock;
pub mod loudness;
pub mod members;
mod monitor;
pub mod offline;
pub mod osc;
pub mod output;
pub mod pages;
pub mod parameter;
pub mod params;
pub mod persisted;
#[cfg(feature = "standalone")]
pub mod player;
mod playing;
mod plugin;
pub mod pose_cell;
pub mod pose_sources;
pub mod presets;
pub mod remote;
pub mod repaint;
pub mod response;
pub mod saved_head;
pub mod saved_headphones;
pub mod scene_frame;
pub mod scene_key;
pub mod settings;
pub mod settled;
pub mod shared_worker;
pub mod slot_names;
pub mod state;
mod table;
pub mod telemetry;
pub mod tier_figures;
pub mod user_state;
pub mod walk;
pub mod worker;

pub use plugin::Promenade;
