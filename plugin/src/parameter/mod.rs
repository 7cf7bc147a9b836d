//! The table of the parameters that hosts and remote controls can set. What reads it: the framework's parameters
//! (`project/hosted.rs`), modules, the editor's words, Open Sound Control, saved states, and the tests of documents and states.

pub(crate) mod cast;
pub mod choices;
pub mod remote;
pub mod row;
pub mod source_knob;
pub(crate) mod table;
pub mod text;

use crate::parameter::choices::{Choice, Variants};
use crate::parameter::row::{LEVEL, METRES, Row, SLOTS, SlotKind, TURN, Unit, Values, WHOLE};
use crate::parameter::source_knob::{KNOBS, Part, SourceKnob};
use crate::parameter::table::table;
use nice_plug::prelude::FloatRange;

/// What sound in the open loses each time the distance doubles, dB.
pub(crate) const USUAL_LAW_DB: f32 = 6.0;

/// The module of the sound.
pub(crate) const SOUND: &str = "Sound";
const POSE: &str = "Pose";
const PATH: &str = "Path";
const EMITTER: &str = "Emitter";
const GROUP: &str = "Group";
const SCENE: &str = "Scene";
const REMOTE: &str = "Remote";

/// Declares the parameters, and the number of each.
macro_rules! parameters {
    ($(#[$meta:meta])* pub enum $name:ident: $row:ty {
        $($(#[$of:meta])* $variant:ident = $value:expr,)* ; $($more:tt)*
    }) => {
        table! {
            $(#[$meta])*
            pub enum $name: $row { $($(#[$of])* $variant = $value,)* ; $($more)* }
        }

        impl $name {
            /// Its place in [`Parameter::EVERY`].
            #[must_use]
            pub fn number(self) -> usize {
                enum Own {
                    $($variant,)*
                }
                match self {
                    $(Self::$variant => Own::$variant as usize,)*
                    Self::Source(knob) => Self::ALL.len() + knob.number(),
                }
            }
        }
    };
}

// In the order of `docs/parameters.md`, with the ids.
parameters! {
    /// A parameter that hosts and remote controls can set.
    ///
    /// Its plain value is a number in its unit, a share of 1, the index of a choice, a slot's number, or 0 or 1 for a switch.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    pub enum Parameter: &'static Row {
        /// Listener position along x of the scene's world, metres.
        X = &Row {
            id: "x", name: "Listener X", module: POSE, values: METRES, default: 0.0, label: "x",
            help: "How far ahead of the room's origin the listener is; drag, or click to type",
        },
        /// Listener position along y of the scene's world, metres.
        Y = &Row {
            id: "y", name: "Listener Y", module: POSE, values: METRES, default: 0.0, label: "y",
            help: "How far to the left of the room's origin the listener is",
        },
        /// Listener position along z of the scene's world, metres.
        Z = &Row {
            id: "z", name: "Listener Z", module: POSE, values: METRES, default: 0.0, label: "z",
            help: "How far above the room's origin the listener's ears are",
        },
        /// Head turn, degrees, positive to the left.
        Yaw = &Row {
            id: "yaw", name: "Yaw", module: POSE, values: TURN, default: 0.0, label: "Yaw",
            help: "Turn of the head, positive to the left",
        },
        /// Head tilt, degrees, positive nose up.
        Pitch = &Row {
            id: "pitch", name: "Pitch", module: POSE, values: Values::Number(Unit::Degree, -90.0, 90.0), default: 0.0,
            label: "Pitch",
            help: "Tilt of the head, positive with the nose up",
        },
        /// Head tilt, degrees, positive right ear down.
        Roll = &Row {
            id: "roll", name: "Roll", module: POSE, values: TURN, default: 0.0, label: "Roll",
            help: "Tilt of the head, positive with the right ear down",
        },
        /// Position along the camera path, share of 1.
        Path = &Row {
            id: "path", name: "Path Position", module: PATH, values: WHOLE, default: 0.0, label: "Position",
            help: "How far along the camera path the listener is, of all the time that it takes, while Path position is \
                chosen above",
        },
        /// What moves the listener: [`choices::Follow`].
        Follow = &Row {
            id: "follow", name: "Follow Path", module: PATH, values: Values::Choice(Choice::Follow), default: 0.0,
            label: "Follow",
            help: "What moves the listener along its camera path, and sources along paths of their own",
        },
        /// Whether position and angles are added to the path's pose, or have no effect while a path is followed.
        Offset = &Row {
            id: "offset", name: "Path Offset", module: PATH, values: Values::Switch, default: 0.0,
            label: "Add position and angles",
            help: "Moves the listener from the path by its own position and angles",
        },
        /// How a head tracker is used: [`choices::Tracking`].
        Tracking = &Row {
            id: "tracking", name: "Head Tracking", module: POSE, values: Values::Choice(Choice::Tracking), default: 1.0,
            label: "Tracker",
            help: "What a head tracker does to the listener",
        },
        /// How far the emitter is moved along x from its place in the scene, metres.
        Ex = &Row {
            id: "ex", name: "Emitter Offset X", module: EMITTER, values: METRES, default: 0.0, label: "x",
            help: "Moves the source ahead from where it was recorded",
        },
        /// How far the emitter is moved along y from its place in the scene, metres.
        Ey = &Row {
            id: "ey", name: "Emitter Offset Y", module: EMITTER, values: METRES, default: 0.0, label: "y",
            help: "Moves the source to the left from where it was recorded",
        },
        /// How far the emitter is moved along z from its place in the scene, metres.
        Ez = &Row {
            id: "ez", name: "Emitter Offset Z", module: EMITTER, values: METRES, default: 0.0, label: "z",
            help: "Moves the source up from where it was recorded",
        },
        /// Angle between the emitters of a stereo input's channels, degrees; 0 for one emitter.
        Spread = &Row {
            id: "spread", name: "Stereo Spread", module: EMITTER, values: Values::Number(Unit::Degree, 0.0, 180.0),
            default: 0.0,
            label: "Stereo",
            help: "Angle between the sources that play the left and the right channel, where the scene starts: 0 plays both \
                with one",
        },
        /// The listener group: [`choices::GroupChoice`].
        Group = &Row {
            id: "group", name: "Listener Group", module: GROUP, values: Values::Choice(Choice::Group), default: 0.0,
            label: "Group",
            help: "Instances of one group hear with one listener, so that several sources share a room",
        },
        /// Whether this instance's listener is that of its group.
        Lead = &Row {
            id: "lead", name: "Lead Group", module: GROUP, values: Values::Switch, default: 0.0, label: "Lead the group",
            help: "The others of the group hear from where this instance's listener is",
        },
        /// Speed against accuracy: [`choices::TierChoice`].
        Tier = &Row {
            id: "tier", name: "Tier", module: SOUND, values: Values::Choice(Choice::Tier), default: 1.0, label: "Quality",
            help: "Speed against accuracy; hosts call it Tier. What is grey, this scene does not have",
        },
        /// Decodes a second of the tiers High and Reference while the listener moves, hertz.
        Rate = &Row {
            id: "rate", name: "Decode Rate", module: SOUND, values: Values::Number(Unit::Hertz, 5.0, 100.0), default: 40.0,
            label: "Updates",
            help: "How often High and Reference work out the sound of a moving listener, times a second; they fade in between",
        },
        /// Share of the rendered sound, of 1.
        Mix = &Row {
            id: "mix", name: "Dry/Wet", module: SOUND, values: WHOLE, default: 1.0, label: "Mix",
            help: "Share of the room's sound; the rest is the track as it came, delayed to match",
        },
        /// Output gain, dB.
        Gain = &Row {
            id: "gain", name: "Output Gain", module: SOUND, values: LEVEL, default: 0.0, label: "Gain",
            help: "Makes everything louder or softer, in decibels",
        },
        /// Level of the direct sound, dB; the least is silence, as of the next two.
        Direct = &Row {
            id: "direct", name: "Direct Level", module: SOUND, values: LEVEL, default: 0.0, label: "Direct",
            help: "Level of what comes straight from the source; -60 dB is silence",
        },
        /// Level of the early reflections, dB.
        Early = &Row {
            id: "early", name: "Early Level", module: SOUND, values: LEVEL, default: 0.0, label: "Early",
            help: "Level of the walls' echoes in the first 80 milliseconds; -60 dB is silence",
        },
        /// Level of the late sound, dB.
        Late = &Row {
            id: "late", name: "Late Level", module: SOUND, values: LEVEL, default: 0.0, label: "Late",
            help: "Level of what the room still says after 80 milliseconds; -60 dB is silence",
        },
        /// Reverberation time as a multiple of the scene's, of 1.
        Decay = &Row {
            id: "decay", name: "Decay", module: SOUND, values: Values::Number(Unit::Share, 0.5, 2.0), default: 1.0,
            label: "Decay",
            help: "How long the room rings, of the time that it takes as it is",
        },
        /// What the direct sound loses each time the distance doubles, dB.
        Law = &Row {
            id: "law", name: "Distance Law", module: SOUND, values: Values::Number(Unit::Decibel, 0.0, 12.0),
            default: USUAL_LAW_DB,
            label: "Distance",
            help: "What the straight sound loses each time the source is twice as far: 6 dB in the open, 0 for none",
        },
        /// Level of the difference between the ears in the room's sound, of 1.
        Width = &Row {
            id: "width", name: "Room Width", module: SOUND, values: Values::Number(Unit::Share, 0.0, 2.0), default: 1.0,
            label: "Width",
            help: "How unlike both ears hear the room: 0 % the same, 100 % as it is; the straight sound stays",
        },
        /// Below this frequency the bass is taken off, hertz; 0 for not.
        LowCut = &Row {
            id: "lowcut", name: "Low Cut", module: SOUND, values: Values::Number(Unit::Hertz, 0.0, 500.0), default: 0.0,
            label: "Low cut",
            help: "Takes the bass off below this frequency, 12 dB an octave, before the room; 0 takes nothing off",
        },
        /// Whether neither the dry nor the direct sound is heard.
        WetSolo = &Row {
            id: "wetsolo", name: "Wet Solo", module: SOUND, values: Values::Switch, default: 0.0, label: "Wet solo",
            help: "The room alone, as on a send: neither the track as it came nor the straight sound",
        },
        /// Whether the dry sound passes, delayed by the latency.
        Bypass = &Row {
            id: "bypass", name: "Bypass", module: SOUND, values: Values::Switch, default: 0.0, label: "Bypass",
            help: "Plays the track without the room, delayed as much as with it",
        },
        /// Where the scene comes from: [`choices::SceneChoice`].
        Scene = &Row {
            id: "scene", name: "Scene", module: SCENE, values: Values::Choice(Choice::Scene), default: 2.0, label: "Scene",
            help: "The room that is played",
        },
        /// Scene file of the library, 0 for the one saved with the project.
        Slot = &Row {
            id: "slot", name: "Library Scene", module: SCENE, values: Values::Slot(SlotKind::Scene), default: 0.0,
            label: "File",
            help: "Which file of the library is played; 0 is the project's own",
        },
        /// Camera path file of the library, 0 for the one saved with the project.
        Walk = &Row {
            id: "walk", name: "Library Path", module: PATH, values: Values::Slot(SlotKind::Walk), default: 0.0, label: "Path",
            help: "Which camera path is used: the project's own, or a file of the library",
        },
        /// Whether Open Sound Control is received.
        Osc = &Row {
            id: "osc", name: "Open Sound Control", module: REMOTE, values: Values::Switch, default: 0.0,
            label: "Listen at port",
            help: "Takes messages of head trackers and remote controls at this port (UDP)",
        },
        /// How late the sound is: [`choices::LatencyChoice`].
        Latency = &Row {
            id: "latency", name: "Latency", module: SOUND, values: Values::Choice(Choice::Latency), default: 0.0,
            label: "Latency",
            help: "How much later the sound comes out than it went in; hosts that make up for it start anew after a change. \
                Presets and undo leave it as it is",
        },
        ;
        /// Of a further source; only instances of many sources have those.
        Source(SourceKnob) = SourceKnob::row
    }
}

impl Parameter {
    /// Those that every instance has, then those of further sources, source by source.
    pub const EVERY: [Self; Self::ALL.len() + KNOBS.len()] = {
        let mut every = [Self::X; Self::ALL.len() + KNOBS.len()];
        let (own, _) = every.split_at_mut(Self::ALL.len());
        own.copy_from_slice(&Self::ALL);
        let mut number = 0;
        while number < KNOBS.len() {
            every[Self::ALL.len() + number] = Self::Source(KNOBS[number]);
            number += 1;
        }
        every
    };

    /// Those of a source's place along x, y and z, 0 for the first source.
    #[must_use]
    pub fn place_of(source: usize) -> [Self; 3] {
        match source.checked_sub(1) {
            None => [Self::Ex, Self::Ey, Self::Ez],
            Some(further) => [Part::X, Part::Y, Part::Z].map(|part| Self::Source(SourceKnob { further, part })),
        }
    }

    /// Those of an instance with so many further sources.
    pub fn of_instance(further: usize) -> impl Iterator<Item = Self> {
        Self::EVERY.into_iter().take(Self::ALL.len() + further * Part::ALL.len())
    }

    /// The id in saved states, in presets and in addresses of Open Sound Control; it never changes.
    #[must_use]
    pub fn id(self) -> &'static str {
        self.row().id
    }

    /// The parameter of an id.
    #[must_use]
    pub fn of_id(id: &str) -> Option<Self> {
        Self::EVERY.into_iter().find(|parameter| parameter.id() == id)
    }

    /// The unit in which values are written; empty for choices, switches and slots.
    #[must_use]
    pub fn unit(self) -> &'static str {
        if let Values::Number(unit, ..) = self.row().values { unit.suffix().trim_start() } else { "" }
    }

    /// Whether it is a share of 1, written in per cent.
    #[must_use]
    pub fn is_share(self) -> bool {
        matches!(self.row().values, Values::Number(Unit::Share, ..))
    }

    /// Whether its values are whole numbers.
    #[must_use]
    pub fn is_whole(self) -> bool {
        !matches!(self.row().values, Values::Number(..))
    }

    /// Whether its range is a circle: the greatest value is the least again.
    #[must_use]
    pub fn is_periodic(self) -> bool {
        self.row().values == TURN
    }

    /// Whether it is on or off.
    #[must_use]
    pub fn is_switch(self) -> bool {
        self.row().values == Values::Switch
    }

    /// What there is to choose from; `None` for what is no choice.
    #[must_use]
    pub fn variants(self) -> Option<Variants> {
        if let Values::Choice(choice) = self.row().values { Some(choice.variants()) } else { None }
    }

    /// The least and the greatest plain value.
    #[must_use]
    pub fn limits(self) -> (f32, f32) {
        match self.row().values {
            Values::Number(_, least, greatest) => (least, greatest),
            Values::Switch => (0.0, 1.0),
            Values::Slot(_) => (0.0, f32::from(SLOTS)),
            Values::Choice(choice) => (0.0, (choice.variants().ids.len() - 1) as f32),
        }
    }

    /// The nearest value within the limits, whole where only whole ones count; the least for what is no number.
    #[must_use]
    pub fn clamp(self, value: f32) -> f32 {
        let (least, greatest) = self.limits();
        let value = if value.is_finite() { value.clamp(least, greatest) } else { least };
        if self.is_whole() { value.round() } else { value }
    }

    /// A plain value as a share of the range, 0 to 1.
    #[must_use]
    pub fn normalized(self, plain: f32) -> f32 {
        let (least, greatest) = self.limits();
        ((plain - least) / (greatest - least)).clamp(0.0, 1.0)
    }

    /// The range of a continuous parameter, in plain values, linear: decibels too, so that a fader's steps are even.
    #[must_use]
    pub fn range(self) -> FloatRange {
        let (min, max) = self.limits();
        FloatRange::Linear { min, max }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::pages::InModules;
    use crate::parameter::source_knob::MOST_FURTHER;
    use crate::project::params::PromenadeParams;
    use crate::project::state::saved_value;
    use nice_plug::plugin::ParamValue;
    use nice_plug::prelude::Params;
    use std::sync::Arc;

    #[test]
    fn every_parameter_of_the_plugin_but_the_revision_is_one() {
        let params = Arc::new(PromenadeParams::default().with_further(MOST_FURTHER));
        let mut ids = InModules(params).param_map().into_iter().map(|(id, ..)| id).collect::<Vec<_>>();
        assert_eq!(ids.remove(Parameter::ALL.len()), "revision");
        assert_eq!(ids, Parameter::EVERY.map(Parameter::id));
        for (index, parameter) in Parameter::EVERY.into_iter().enumerate() {
            assert_eq!(parameter.number(), index);
            assert_eq!(Parameter::of_id(parameter.id()), Some(parameter), "two have one id");
        }
    }

    #[test]
    fn every_whole_parameter_is_a_choice_a_switch_or_a_number_of_a_file() {
        for parameter in Parameter::EVERY {
            let default = parameter.row().default;
            assert_eq!(parameter.clamp(default), default, "{parameter:?}");
            let saved = saved_value(parameter, default);
            assert_eq!(parameter.is_whole(), !matches!(saved, ParamValue::F32(_)), "{parameter:?} is saved as {saved:?}");
        }
    }
}
