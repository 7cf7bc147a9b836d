//! Promenade in a browser: core as a WebAssembly module with plain exported functions, and the page that plays it.
//!
//! One instance of the module plays one scene at one sample rate. A page makes it in a Web Worker, where reading a scene may
//! take its time, and hands its memory to the audio thread (`page/engine/`); so the audio thread prepares nothing, and no
//! shared memory is needed. [`files`] are the page itself, for whoever writes it to a folder.
//!
//! ```
//! use promenade_web::{Engine, LoadOptions};
//!
//! // A Worker makes an instance; the page calls the same by the names of `exports`.
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/library/living-room.promenade");
//! let mut engine = Engine::new(48_000.0);
//! engine.load(&std::fs::read(file)?, LoadOptions::default())?;
//!
//! // The audio thread writes a block of the dry sound and reads the ears; there are no further sounds.
//! let mut heard = 0.0_f32;
//! for _ in 0..40 {
//!     engine.input(0)[..128].fill(0.5);
//!     engine.process(1, 0, 128);
//!     heard = heard.max(engine.ear(0)[..128].iter().fold(0.0, |most, sample| most.max(sample.abs())));
//! }
//! assert!(heard > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
