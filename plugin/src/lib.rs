//! Promenade as a plugin: parameters, state, scene loading and the shell around [`promenade_core::Spatializer`].
//!
//! Threads: the audio thread owns [`Promenade`] and calls `process` and `reset`. Whatever reads a file, parses or allocates is
//! done by the [loader](playing::loader) on the host's main thread or on a background thread; another background thread decodes
//! poses. All instances in a process share these threads.

#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

pub mod answers;
pub mod budget;
pub mod editor;
mod export;
pub mod history;
pub mod library;
pub mod listener;
pub mod osc;
pub mod parameter;
pub mod playing;
pub mod project;
pub mod telemetry;
pub mod tracker;
pub mod worker;

pub use export::{Promenade, PromenadeMany, PromenadeMany64};
