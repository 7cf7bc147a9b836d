//! The plugins of the library: of one source, and of many. They differ in their inputs and in what goes with these.

use crate::parameter::source_knob::{MANY_FURTHER, MOST_FURTHER};
use crate::playing::output::{LAYOUTS, layouts_of_many};
use nice_plug::prelude::AudioIOLayout;

/// Plugins in the library.
pub(crate) const COUNT: usize = 3;

/// What hosts know of a plugin. Its ids never change.
pub(crate) struct Kind {
    /// Further sources.
    pub(crate) further: usize,
    /// Name.
    pub(crate) name: &'static str,
    /// Id in CLAP.
    pub(crate) clap_id: &'static str,
    /// What it is for, a sentence without its stop.
    pub(crate) description: &'static str,
    /// Class in VST3.
    pub(crate) vst3_class: [u8; 16],
    /// Layouts of channels, the usual one first.
    pub(crate) layouts: &'static [AudioIOLayout],
}

/// All of them, in the order in which hosts list them.
pub(crate) const KINDS: [Kind; COUNT] = [
    Kind {
        further: 0,
        name: "Promenade",
        clap_id: "audio.promenade.promenade",
        description: "Places a dry track in a captured room, for a listener who walks and turns",
        vst3_class: *b"PromenadeSpatial",
        layouts: LAYOUTS,
    },
    Kind {
        further: MANY_FURTHER,
        name: "Promenade Many",
        clap_id: "audio.promenade.promenade-many",
        description: "Places sixteen dry tracks in a captured room, for a listener who walks and turns",
        vst3_class: *b"PromenadeSp.Many",
        layouts: &layouts_of_many(MANY_FURTHER),
    },
    Kind {
        further: MOST_FURTHER,
        name: "Promenade Many 64",
        clap_id: "audio.promenade.promenade-many-64",
        description: "Places sixty-four dry tracks in a captured room, for a listener who walks and turns",
        vst3_class: *b"PromenadeSp.Mn64",
        layouts: &layouts_of_many(MOST_FURTHER),
    },
];

impl Kind {
    /// That of so many further sources.
    pub(crate) const fn of(further: usize) -> &'static Self {
        const ALL: &[Kind; COUNT] = &KINDS;
        let mut number = 0;
        while number + 1 < COUNT && ALL[number].further < further {
            number += 1;
        }
        &ALL[number]
    }
}
