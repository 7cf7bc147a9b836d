//! The entry points that hosts look up in the library.

pub(crate) mod pages;
mod plugin;

pub use plugin::Promenade;

mod clap;
mod vst3;
