//! The entry points that hosts look up in the library.

mod further_input;
mod input;
pub(crate) mod pages;
mod plugin;
mod silence;

use crate::parameter::source_knob::MOST_FURTHER;
pub use plugin::Promenade;

/// The plugin of many sources.
pub type PromenadeMany = Promenade<MOST_FURTHER>;

mod clap;
mod vst3;
