//! The variants of the parameters that are choices. Their ids never change.

use nice_plug::prelude::Enum;
use promenade_core::Latency;
use promenade_judge::trade::STANDARD_JNDS;

/// Ids, names and meanings of a choice's variants, in the order of their indices.
#[derive(Clone, Copy, Debug)]
pub struct Variants {
    /// The ids in saved states.
    pub ids: &'static [&'static str],
    /// The names that hosts show.
    pub names: &'static [&'static str],
    /// What each does.
    pub help: &'static [&'static str],
}

/// Declares the choices: for each variant its id, its name, and what it does.
macro_rules! choices {
    ($($(#[$meta:meta])* $choice:ident: $type:ident {
        $($(#[$doc:meta])* $variant:ident = $id:tt, $name:tt, $help:tt;)*
    })*) => {
        $(
            $(#[$meta])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
            pub enum $type {
                $($(#[$doc])* #[id = $id] #[name = $name] $variant,)*
            }
        )*

        /// The parameters that are choices.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Choice {
            $($(#[$meta])* $choice,)*
        }

        impl Choice {
            /// What there is to choose from.
            pub fn variants(self) -> Variants {
                match self {
                    $(Self::$choice => Variants { ids: &[$($id),*], names: &[$($name),*], help: &[$($help),*] },)*
                }
            }
        }
    };
}

choices! {
    /// What moves the listener.
    Follow: Follow {
        /// The position and angle parameters.
        Off = "off", "Off", "The listener stays where position and angles say";
        /// The camera path, at the path position parameter.
        Position = "position", "Path position", "The listener is where Position says, along the camera path";
        /// The camera path, at the time of the host's transport.
        Transport = "transport", "Transport", "The listener walks the camera path as the host plays";
    }

    /// Which parameters say where sources are.
    Place: PlaceChoice {
        /// Those along the axes.
        Cartesian = "cartesian", "Cartesian", "x, y and z move the sources from their places in the scene";
        /// Those of directions.
        Polar = "polar", "Polar", "Azimuth, elevation and distance put the sources about where the scene's listener starts";
    }

    /// How a head tracker is used.
    Tracking: Tracking {
        /// Not at all.
        Off = "off", "Off", "A head tracker has no effect";
        /// Its orientation turns the head on top of the other sources.
        Head = "head", "Head", "The tracker turns the head, on top of position, angles or path";
        /// Its orientation and position are added to the other sources, in the axes of their pose.
        Pose = "pose", "Head and position", "The tracker turns and moves the head, on top of position, angles or path";
        /// It replaces the other sources.
        Absolute = "absolute", "Absolute", "The tracker alone says where the head is and looks";
    }

    /// Which listener group an instance belongs to.
    Group: GroupChoice {
        /// None: a listener of its own.
        Off = "off", "Off", "This instance has a listener of its own";
        /// Group A.
        A = "a", "A", "Shares the listener of the first group";
        /// Group B.
        B = "b", "B", "Shares the listener of the second group";
        /// Group C.
        C = "c", "C", "Shares the listener of the third group";
        /// Group D.
        D = "d", "D", "Shares the listener of the fourth group";
    }

    /// [`Latency`] as a parameter.
    Latency: LatencyChoice {
        /// [`Latency::Frame`].
        Frame = "frame", "Frame", "The least work; for mixing, since hosts make up for it";
        /// [`Latency::Samples64`].
        Samples64 = "64", "64 samples",
            "Direct sound and first reflections without waiting, for playing along; takes about half as much again";
        /// [`Latency::None`].
        None = "none", "None", "Nothing is reported and the dry sound comes at once; the room's is a millisecond later";
    }

    /// How near to all of the scene it stays.
    Accuracy: AccuracyChoice {
        /// All of it.
        All = "all", "All", "Everything that the scene holds, as bounces always have it";
        /// Within a quarter of a just noticeable difference.
        Quarter = "0.25", "0.25 JND", "As much as stays within a quarter of what is just noticed: for mixing";
        /// Within half of one.
        Half = "0.5", "0.5 JND", "As much as stays within half of what is just noticed";
        /// Within one.
        One = "1", "1 JND", "As much as stays within what is just noticed";
        /// Within two.
        Two = "2", "2 JND", "As much as stays within twice of what is just noticed: for many tracks";
    }

    /// Where the scene comes from.
    Scene: SceneChoice {
        /// The factory scene of room A.
        RoomA = "iosr-room-a", "IoSR room A", "A room of the factory, an office";
        /// The factory scene of room B.
        RoomB = "iosr-room-b", "IoSR room B", "A room of the factory, a class room";
        /// The user's library, or the scene saved with the project.
        Library = "library", "Library", "A file of your own";
    }
}

impl GroupChoice {
    /// Index of the group in the process, from 0; `None` without a group.
    pub fn number(self) -> Option<usize> {
        (self as usize).checked_sub(1)
    }
}

impl AccuracyChoice {
    /// The most that it may be off, in differences that are just noticed; `None` where all of the scene is played.
    #[must_use]
    pub fn jnds(self) -> Option<f32> {
        (self as usize).checked_sub(1).map(|index| STANDARD_JNDS[index])
    }

    /// The one of two that may be off by more.
    #[must_use]
    pub fn coarser(self, other: Self) -> Self {
        if self as usize > other as usize { self } else { other }
    }
}

impl From<LatencyChoice> for Latency {
    fn from(choice: LatencyChoice) -> Self {
        Self::ALL[choice as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ids_of_the_latencies_are_their_names() {
        assert_eq!(LatencyChoice::ids().unwrap(), Latency::ALL.map(Latency::name));
        for (index, latency) in Latency::ALL.into_iter().enumerate() {
            assert_eq!(Latency::from(LatencyChoice::from_index(index)), latency);
        }
    }

    #[test]
    fn the_ids_of_accuracies_are_their_numbers() {
        let found = (0..5).map(|index| AccuracyChoice::from_index(index).jnds()).collect::<Vec<_>>();
        let named = AccuracyChoice::ids().unwrap().iter().map(|id| id.parse().ok()).collect::<Vec<Option<f32>>>();
        assert_eq!(found, named);
        assert_eq!(found[1..], STANDARD_JNDS.map(Some));
    }
}
