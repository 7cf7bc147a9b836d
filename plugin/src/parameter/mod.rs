//! The parameters that hosts and remote controls can set: ids, units and ranges.

pub(crate) mod cast;
pub mod choices;
pub mod remote;
pub mod source_knob;
pub(crate) mod table;

use crate::parameter::choices::{Follow, GroupChoice, LatencyChoice, SceneChoice, TierChoice, Tracking};
use crate::parameter::source_knob::{KNOBS, Part, SourceKnob};
use crate::parameter::table::table;
use nice_plug::prelude::{Enum, FloatRange};

/// Number of library files that a slot parameter can choose from.
pub const SLOTS: u8 = 64;

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
    pub enum Parameter: &'static str {
        /// Listener position along x of the scene's world, metres.
        X = "x",
        /// Listener position along y of the scene's world, metres.
        Y = "y",
        /// Listener position along z of the scene's world, metres.
        Z = "z",
        /// Head turn, degrees, positive to the left.
        Yaw = "yaw",
        /// Head tilt, degrees, positive nose up.
        Pitch = "pitch",
        /// Head tilt, degrees, positive right ear down.
        Roll = "roll",
        /// Position along the camera path, share of 1.
        Path = "path",
        /// What moves the listener: [`Follow`].
        Follow = "follow",
        /// Whether position and angles are added to the path's pose, or have no effect while a path is followed.
        Offset = "offset",
        /// How a head tracker is used: [`Tracking`].
        Tracking = "tracking",
        /// How far the emitter is moved along x from its place in the scene, metres.
        Ex = "ex",
        /// How far the emitter is moved along y from its place in the scene, metres.
        Ey = "ey",
        /// How far the emitter is moved along z from its place in the scene, metres.
        Ez = "ez",
        /// Angle between the emitters of a stereo input's channels, degrees; 0 for one emitter.
        Spread = "spread",
        /// The listener group: [`GroupChoice`].
        Group = "group",
        /// Whether this instance's listener is that of its group.
        Lead = "lead",
        /// Speed against accuracy: [`TierChoice`].
        Tier = "tier",
        /// Decodes a second of the tiers High and Reference while the listener moves, hertz.
        Rate = "rate",
        /// Share of the rendered sound, of 1.
        Mix = "mix",
        /// Output gain, dB.
        Gain = "gain",
        /// Level of the direct sound, dB; the least is silence, as of the next two.
        Direct = "direct",
        /// Level of the early reflections, dB.
        Early = "early",
        /// Level of the late sound, dB.
        Late = "late",
        /// Reverberation time as a multiple of the scene's, of 1.
        Decay = "decay",
        /// What the direct sound loses each time the distance doubles, dB.
        Law = "law",
        /// Level of the difference between the ears in the room's sound, of 1.
        Width = "width",
        /// Below this frequency the bass is taken off, hertz; 0 for not.
        LowCut = "lowcut",
        /// Whether neither the dry nor the direct sound is heard.
        WetSolo = "wetsolo",
        /// Whether the dry sound passes, delayed by the latency.
        Bypass = "bypass",
        /// Where the scene comes from: [`SceneChoice`].
        Scene = "scene",
        /// Scene file of the library, 0 for the one saved with the project.
        Slot = "slot",
        /// Camera path file of the library, 0 for the one saved with the project.
        Walk = "walk",
        /// Whether Open Sound Control is received.
        Osc = "osc",
        /// How late the sound is: [`LatencyChoice`].
        Latency = "latency",
        ;
        /// Of a further source; only instances of many sources have those.
        Source(SourceKnob) = SourceKnob::id
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
        self.row()
    }

    /// The parameter of an id.
    #[must_use]
    pub fn of_id(id: &str) -> Option<Self> {
        Self::EVERY.into_iter().find(|parameter| parameter.id() == id)
    }

    /// The unit in which values are written; empty for choices, switches and slots.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::X | Self::Y | Self::Z | Self::Ex | Self::Ey | Self::Ez => "m",
            Self::Yaw | Self::Pitch | Self::Roll | Self::Spread => "deg",
            Self::Path | Self::Mix | Self::Decay | Self::Width => "%",
            Self::Rate | Self::LowCut => "Hz",
            Self::Gain | Self::Direct | Self::Early | Self::Late | Self::Law => "dB",
            Self::Source(knob) => {
                if knob.part == Part::Level {
                    "dB"
                } else {
                    "m"
                }
            }
            _ => "",
        }
    }

    /// Whether it is a share of 1, written in per cent.
    #[must_use]
    pub fn is_share(self) -> bool {
        self.unit() == "%"
    }

    /// Whether its values are whole numbers.
    #[must_use]
    pub fn is_whole(self) -> bool {
        self.unit().is_empty()
    }

    /// Whether its range is a circle: the greatest value is the least again.
    #[must_use]
    pub fn is_periodic(self) -> bool {
        matches!(self, Self::Yaw | Self::Roll)
    }

    /// Whether it is on or off.
    #[must_use]
    pub fn is_switch(self) -> bool {
        matches!(self, Self::Offset | Self::Lead | Self::WetSolo | Self::Bypass | Self::Osc)
    }

    /// Ids and names of a choice's variants, in the order of their indices; `None` for others.
    #[must_use]
    pub fn variants(self) -> Option<(&'static [&'static str], &'static [&'static str])> {
        fn of<T: Enum + 'static>() -> Option<(&'static [&'static str], &'static [&'static str])> {
            Some((T::ids()?, T::variants()))
        }
        match self {
            Self::Follow => of::<Follow>(),
            Self::Tracking => of::<Tracking>(),
            Self::Group => of::<GroupChoice>(),
            Self::Tier => of::<TierChoice>(),
            Self::Latency => of::<LatencyChoice>(),
            Self::Scene => of::<SceneChoice>(),
            _ => None,
        }
    }

    /// The least and the greatest plain value.
    #[must_use]
    pub fn limits(self) -> (f32, f32) {
        match self {
            Self::X | Self::Y | Self::Z | Self::Ex | Self::Ey | Self::Ez => (-50.0, 50.0),
            Self::Yaw | Self::Roll => (-180.0, 180.0),
            Self::Pitch => (-90.0, 90.0),
            Self::Spread => (0.0, 180.0),
            Self::Rate => (5.0, 100.0),
            Self::Gain | Self::Direct | Self::Early | Self::Late => (-60.0, 12.0),
            Self::Source(knob) if knob.part == Part::Level => Self::Gain.limits(),
            Self::Source(_) => Self::Ex.limits(),
            Self::Decay => (0.5, 2.0),
            Self::Law => (0.0, 12.0),
            Self::Width => (0.0, 2.0),
            Self::LowCut => (0.0, 500.0),
            Self::Slot | Self::Walk => (0.0, f32::from(SLOTS)),
            _ => (0.0, self.variants().map_or(1.0, |(ids, _)| (ids.len() - 1) as f32)),
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
    use crate::parameter::source_knob::MOST_FURTHER;
    use crate::project::params::PromenadeParams;
    use nice_plug::prelude::Params;

    #[test]
    fn every_parameter_of_the_plugin_but_the_revision_is_one() {
        let mut ids = PromenadeParams::default().param_map().into_iter().map(|(id, ..)| id).collect::<Vec<_>>();
        ids.retain(|id| id != "revision");
        assert_eq!(ids, Parameter::ALL.map(Parameter::id));
        let params = PromenadeParams::default().with_further(MOST_FURTHER);
        let of_sources = params.source_map().into_iter().map(|(id, _)| id).collect::<Vec<_>>();
        assert_eq!(of_sources, Parameter::EVERY[ids.len()..].iter().map(|parameter| parameter.id()).collect::<Vec<_>>());
        for (index, parameter) in Parameter::EVERY.into_iter().enumerate() {
            assert_eq!(parameter.number(), index);
            assert_eq!(Parameter::of_id(parameter.id()), Some(parameter), "two have one id");
        }
    }

    #[test]
    fn every_whole_parameter_is_a_choice_a_switch_or_a_number_of_a_file() {
        for parameter in Parameter::EVERY {
            let known = parameter.variants().is_some()
                || parameter.is_switch()
                || matches!(parameter, Parameter::Slot | Parameter::Walk);
            assert_eq!(known, parameter.is_whole(), "{parameter:?}");
        }
    }
}
