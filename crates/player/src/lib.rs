//! The offline player: the one way to play a file through a scene.
//!
//! [`Stream`] plays samples as a host would, in time with what it is given. [`Player`] feeds it with whole sounds of any rate,
//! further sounds and headphones, and plays the published model clip by clip. [`command::main`] is the command line of
//! `promenade-player` and of `promenade render`.
//!
//! None of this is for the audio thread: all of it may allocate and take its time.

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
