//! Promenade in a browser: core as a WebAssembly module with plain exported functions, and the page that plays it.
//!
//! One instance of the module plays one scene at one sample rate. A page makes it in a Web Worker, where reading a scene may
//! take its time, and hands its memory to the audio thread (`page/engine/`); so the audio thread prepares nothing, and no
//! shared memory is needed. [`files`] are the page itself, for whoever writes it to a folder.

#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

mod description;
mod engine;
pub mod exports;
mod glide;
mod listener;
mod mailbox;
#[cfg(not(target_family = "wasm"))]
mod page;

pub use engine::{Engine, LoadOptions};
#[cfg(not(target_family = "wasm"))]
pub use page::{ENGINE_FILE, check_folder, files, media_type};
