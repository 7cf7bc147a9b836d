//! The entry points that hosts look up in the library.

use crate::Promenade;

nice_plug::nice_export_clap!(Promenade);
nice_plug::nice_export_vst3!(Promenade);
