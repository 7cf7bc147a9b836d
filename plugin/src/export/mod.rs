//! The entry points that hosts look up in the library.

mod further_input;
mod guard;
mod input;
mod kind;
pub(crate) mod pages;
mod plugin;
mod silence;

use crate::parameter::source_knob::{MANY_FURTHER, MOST_FURTHER};
pub use plugin::Promenade;

/// The plugin of 16 sources.
pub type PromenadeMany = Promenade<MANY_FURTHER>;
/// The plugin of 64 sources.
pub type PromenadeMany64 = Promenade<MOST_FURTHER>;

pub(crate) mod clap;
mod vst3;
