//! The offline player: the one way to play a file through a scene.
//!
//! [`Stream`] plays samples as a host would, in time with what it is given. [`Player`] feeds it with whole sounds of any rate,
//! further sounds and headphones, and plays the published model clip by clip. [`command::main`] is the command line of
//! `promenade-player` and of `promenade render`.
//!
//! None of this is for the audio thread: all of it may allocate and take its time.
//!
//! ```
//! use promenade_core::glam::Vec3;
//! use promenade_core::{Pose, Scene};
//! use promenade_player::{Player, Playing};
//! use std::sync::Arc;
//!
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/loft.promenade");
//! let scene = Arc::new(Scene::from_bytes(&std::fs::read(file)?)?);
//! let mut player = Player::new(&scene, 48_000.0, Playing::Stream)?;
//!
//! // A click, heard on a walk away from the source at 1 m/s.
//! let mut dry = vec![0.0; 4_800];
//! dry[0] = 1.0;
//! let [left, right] = player.render(&dry, &mut |seconds| {
//!     Pose::from_ypr(Vec3::new(-seconds as f32, 0.0, 0.0), 0.0, 0.0, 0.0)
//! })?;
//! assert!(left.len() == dry.len() && left.iter().chain(&right).any(|sample| *sample != 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

#[cfg(feature = "files")]
pub mod command;
#[cfg(feature = "files")]
mod error;
#[cfg(feature = "files")]
mod player;
mod stream;

#[cfg(feature = "files")]
pub use {
    error::PlayerError,
    player::{ClipPlayer, Mix, Player, Playing, Source, Voice, render_response},
    promenade_sofa::{read_head, read_headphones},
};

pub use stream::{Ears, Stream};
