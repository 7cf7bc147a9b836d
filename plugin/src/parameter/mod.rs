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
use crate::parameter::row::Values::{self, Number, Slot, Switch};
use crate::parameter::row::{AWAY, LEVEL, METRES, QUARTER, Row, SLOTS, SlotKind, TURN, Unit, WHOLE};
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

/// Declares the parameters: of each its module, its id in saved states, its name in hosts, its values, the value of a new
/// instance, its label in the editor, and what it does.
macro_rules! parameters {
    ($(#[$meta:meta])* pub enum $name:ident {
        $($(#[$of:meta])* $variant:ident = $module:ident, $id:literal, $host_name:literal, $values:expr, $default:expr,
            $label:literal, $help:literal;)*
        | $($more:tt)*
    }) => {
        table! {
            $(#[$meta])*
            pub enum $name: &'static Row {
                $($(#[$of])* $variant = &Row {
                    id: $id, name: $host_name, module: $module, values: $values, default: $default, label: $label, help: $help,
                },)* ;
                $($more)*
            }
        }

        impl $name {
            /// Its place in [`Parameter::EVERY`].
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
    pub enum Parameter {
        /// Listener position along x of the scene's world, metres.
        X = POSE, "x", "Listener X", METRES, 0.0, "x",
            "How far ahead of the room's origin the listener is; drag, or click to type";
        /// Listener position along y of the scene's world, metres.
        Y = POSE, "y", "Listener Y", METRES, 0.0, "y", "How far to the left of the room's origin the listener is";
        /// Listener position along z of the scene's world, metres.
        Z = POSE, "z", "Listener Z", METRES, 0.0, "z", "How far above the room's origin the listener's ears are";
        /// Head turn, degrees, positive to the left.
        Yaw = POSE, "yaw", "Yaw", TURN, 0.0, "Yaw", "Turn of the head, positive to the left";
        /// Head tilt, degrees, positive nose up.
        Pitch = POSE, "pitch", "Pitch", QUARTER, 0.0, "Pitch",
            "Tilt of the head, positive with the nose up";
        /// Head tilt, degrees, positive right ear down.
        Roll = POSE, "roll", "Roll", TURN, 0.0, "Roll", "Tilt of the head, positive with the right ear down";
        /// Position along the camera path, share of 1.
        Path = PATH, "path", "Path Position", WHOLE, 0.0, "Position",
            "How far along the camera path the listener is, of all the time that it takes, while Path position is chosen \
             above";
        /// What moves the listener: [`choices::Follow`].
        Follow = PATH, "follow", "Follow Path", Values::Choice(Choice::Follow), 0.0, "Follow",
            "What moves the listener along its camera path, and sources along paths of their own";
        /// Whether position and angles are added to the path's pose, or have no effect while a path is followed.
        Offset = PATH, "offset", "Path Offset", Switch, 0.0, "Add position and angles",
            "Moves the listener from the path by its own position and angles";
        /// How a head tracker is used: [`choices::Tracking`].
        Tracking = POSE, "tracking", "Head Tracking", Values::Choice(Choice::Tracking), 1.0, "Tracker",
            "What a head tracker does to the listener";
        /// How far the emitter is moved along x from its place in the scene, metres.
        Ex = EMITTER, "ex", "Emitter Offset X", METRES, 0.0, "x", "Moves the source ahead from where it was recorded";
        /// How far the emitter is moved along y from its place in the scene, metres.
        Ey = EMITTER, "ey", "Emitter Offset Y", METRES, 0.0, "y", "Moves the source to the left from where it was recorded";
        /// How far the emitter is moved along z from its place in the scene, metres.
        Ez = EMITTER, "ez", "Emitter Offset Z", METRES, 0.0, "z", "Moves the source up from where it was recorded";
        /// Which parameters say where sources are: [`choices::PlaceChoice`].
        Place = EMITTER, "place", "Source Place", Values::Choice(Choice::Place), 0.0, "Place by",
            "Which parameters say where sources are: x, y and z, or azimuth, elevation and distance";
        /// Azimuth of the emitter from where the scene's listener starts, degrees, positive to the left.
        Azimuth = EMITTER, "azimuth", "Source Azimuth", TURN, 0.0, "Azimuth",
            "Direction of the source from where the scene's listener starts, positive to the left";
        /// Its elevation, degrees.
        Elevation = EMITTER, "elevation", "Source Elevation", QUARTER, 0.0, "Elevation",
            "Angle of the source above where the scene's listener starts";
        /// Its distance, metres.
        Distance = EMITTER, "distance", "Source Distance", AWAY, 1.5, "Distance",
            "Distance of the source from where the scene's listener starts";
        /// Angle between the emitters of a stereo input's channels, degrees; 0 for one emitter.
        Spread = EMITTER, "spread", "Stereo Spread", Number(Unit::Degree, 0.0, 180.0), 0.0, "Stereo",
            "Angle between the sources that play the left and the right channel, where the scene starts: 0 plays both \
             with one";
        /// The listener group: [`choices::GroupChoice`].
        Group = GROUP, "group", "Listener Group", Values::Choice(Choice::Group), 0.0, "Group",
            "Instances of one group hear with one listener, so that several sources share a room";
        /// Whether this instance's listener is that of its group.
        Lead = GROUP, "lead", "Lead Group", Switch, 0.0, "Lead the group",
            "The others of the group hear from where this instance's listener is";
        /// Decodes a second of a trained scene while the listener moves, hertz.
        Rate = SOUND, "rate", "Decode Rate", Number(Unit::Hertz, 5.0, 100.0), 40.0, "Updates",
            "How often a trained scene works out the sound of a moving listener, times a second; it fades in between";
        /// Share of the rendered sound, of 1.
        Mix = SOUND, "mix", "Dry/Wet", WHOLE, 1.0, "Mix",
            "Share of the room's sound; the rest is the track as it came, delayed to match";
        /// Output gain, dB.
        Gain = SOUND, "gain", "Output Gain", LEVEL, 0.0, "Gain", "Makes everything louder or softer, in decibels";
        /// Level of the direct sound, dB; the least is silence, as of the next two.
        Direct = SOUND, "direct", "Direct Level", LEVEL, 0.0, "Direct",
            "Level of what comes straight from the source; -60 dB is silence";
        /// Level of the early reflections, dB.
        Early = SOUND, "early", "Early Level", LEVEL, 0.0, "Early",
            "Level of the walls' echoes in the first 80 milliseconds; -60 dB is silence";
        /// Level of the late sound, dB.
        Late = SOUND, "late", "Late Level", LEVEL, 0.0, "Late",
            "Level of what the room still says after 80 milliseconds; -60 dB is silence";
        /// Reverberation time as a multiple of the scene's, of 1.
        Decay = SOUND, "decay", "Decay", Number(Unit::Share, 0.5, 2.0), 1.0, "Decay",
            "How long the room rings, of the time that it takes as it is";
        /// What the direct sound loses each time the distance doubles, dB.
        Law = SOUND, "law", "Distance Law", Number(Unit::Decibel, 0.0, 12.0), USUAL_LAW_DB, "Distance",
            "What the straight sound loses each time the source is twice as far: 6 dB in the open, 0 for none";
        /// Level of the difference between the ears in the room's sound, of 1.
        Width = SOUND, "width", "Room Width", Number(Unit::Share, 0.0, 2.0), 1.0, "Width",
            "How unlike both ears hear the room: 0 % the same, 100 % as it is; the straight sound stays";
        /// Below this frequency the bass is taken off, hertz; 0 for not.
        LowCut = SOUND, "lowcut", "Low Cut", Number(Unit::Hertz, 0.0, 500.0), 0.0, "Low cut",
            "Takes the bass off below this frequency, 12 dB an octave, before the room; 0 takes nothing off";
        /// Whether neither the dry nor the direct sound is heard.
        WetSolo = SOUND, "wetsolo", "Wet Solo", Switch, 0.0, "Wet solo",
            "The room alone, as on a send: neither the track as it came nor the straight sound";
        /// Whether the dry sound passes, delayed by the latency.
        Bypass = SOUND, "bypass", "Bypass", Switch, 0.0, "Bypass",
            "Plays the track without the room, delayed as much as with it";
        /// Where the scene comes from: [`choices::SceneChoice`].
        Scene = SCENE, "scene", "Scene", Values::Choice(Choice::Scene), 2.0, "Scene", "The room that is played";
        /// Scene file of the library, 0 for the one saved with the project.
        Slot = SCENE, "slot", "Library Scene", Slot(SlotKind::Scene), 0.0, "File",
            "Which file of the library is played; 0 is the project's own";
        /// Camera path file of the library, 0 for the one saved with the project.
        Walk = PATH, "walk", "Library Path", Slot(SlotKind::Walk), 0.0, "Path",
            "Which camera path is used: the project's own, or a file of the library";
        /// Whether Open Sound Control is received.
        Osc = REMOTE, "osc", "Open Sound Control", Switch, 0.0, "Listen at port",
            "Takes messages of head trackers and remote controls at this port (UDP)";
        /// How late the sound is: [`choices::LatencyChoice`].
        Latency = SOUND, "latency", "Latency", Values::Choice(Choice::Latency), 0.0, "Latency",
            "How much later the sound comes out than it went in; hosts that make up for it start anew after a change. \
             Presets and undo leave it as it is";
        /// How near to all of the scene it stays: [`choices::AccuracyChoice`].
        Accuracy = SOUND, "accuracy", "Accuracy", Values::Choice(Choice::Accuracy), 0.0, "Accuracy",
            "How near to all of the scene it stays, in just noticeable differences (JND): the less, the less work";
        |
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
    pub fn place_of(source: usize) -> [Self; 3] {
        match source.checked_sub(1) {
            None => [Self::Ex, Self::Ey, Self::Ez],
            Some(further) => [Part::X, Part::Y, Part::Z].map(|part| Self::Source(SourceKnob { further, part })),
        }
    }

    /// The azimuth, elevation and distance of a source, 0 for the first.
    pub fn polar_of(source: usize) -> [Self; 3] {
        match source.checked_sub(1) {
            None => [Self::Azimuth, Self::Elevation, Self::Distance],
            Some(further) => {
                [Part::Azimuth, Part::Elevation, Part::Distance].map(|part| Self::Source(SourceKnob { further, part }))
            }
        }
    }

    /// Those of an instance with so many further sources.
    pub fn of_instance(further: usize) -> impl Iterator<Item = Self> {
        Self::EVERY.into_iter().take(Self::ALL.len() + further * Part::ALL.len())
    }

    /// The id in saved states, in presets and in addresses of Open Sound Control; it never changes.
    pub fn id(self) -> &'static str {
        self.row().id
    }

    /// The parameter of an id.
    pub fn of_id(id: &str) -> Option<Self> {
        Self::EVERY.into_iter().find(|parameter| parameter.id() == id)
    }

    /// The unit in which values are written; empty for choices, switches and slots.
    pub fn unit(self) -> &'static str {
        if let Values::Number(unit, ..) = self.row().values { unit.suffix().trim_start() } else { "" }
    }

    /// Whether it is a share of 1, written in per cent.
    pub fn is_share(self) -> bool {
        matches!(self.row().values, Values::Number(Unit::Share, ..))
    }

    /// Whether its values are whole numbers.
    pub fn is_whole(self) -> bool {
        !matches!(self.row().values, Values::Number(..))
    }

    /// Whether its range is a circle: the greatest value is the least again.
    pub fn is_periodic(self) -> bool {
        self.row().values == TURN
    }

    /// Whether it is on or off.
    pub fn is_switch(self) -> bool {
        self.row().values == Values::Switch
    }

    /// What there is to choose from; `None` for what is no choice.
    pub fn variants(self) -> Option<Variants> {
        if let Values::Choice(choice) = self.row().values { Some(choice.variants()) } else { None }
    }

    /// The least and the greatest plain value.
    pub fn limits(self) -> (f32, f32) {
        match self.row().values {
            Values::Number(_, least, greatest) => (least, greatest),
            Values::Switch => (0.0, 1.0),
            Values::Slot(_) => (0.0, f32::from(SLOTS)),
            Values::Choice(choice) => (0.0, (choice.variants().ids.len() - 1) as f32),
        }
    }

    /// The nearest value within the limits, whole where only whole ones count; the least for what is no number.
    pub fn clamp(self, value: f32) -> f32 {
        let (least, greatest) = self.limits();
        let value = if value.is_finite() { value.clamp(least, greatest) } else { least };
        if self.is_whole() { value.round() } else { value }
    }

    /// A plain value as a share of the range, 0 to 1.
    pub fn normalized(self, plain: f32) -> f32 {
        let (least, greatest) = self.limits();
        ((plain - least) / (greatest - least)).clamp(0.0, 1.0)
    }

    /// The range of a continuous parameter, in plain values, linear: decibels too, so that a fader's steps are even.
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
    use crate::project::{params::PromenadeParams, state::saved_value};
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
