//! The entry points that hosts look up in the library.

use crate::Promenade;

mod clap;

nice_plug::nice_export_vst3!(Promenade);
