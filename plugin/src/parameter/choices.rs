//! The variants of the parameters that are choices. Their ids never change.

use nice_plug::prelude::Enum;
use promenade_core::{Latency, Tier};

/// Declares a choice: for each variant its id and its name.
macro_rules! choice {
    ($(#[$meta:meta])* pub enum $choice:ident { $($(#[$doc:meta])* $variant:ident = $id:tt, $name:tt;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
        pub enum $choice {
            $($(#[$doc])* #[id = $id] #[name = $name] $variant,)*
        }
    };
}

choice! {
    /// What moves the listener.
    pub enum Follow {
        /// The position and angle parameters.
        Off = "off", "Off";
        /// The camera path, at the path position parameter.
        Position = "position", "Path position";
        /// The camera path, at the time of the host's transport.
        Transport = "transport", "Transport";
    }
}

choice! {
    /// How a head tracker is used.
    pub enum Tracking {
        /// Not at all.
        Off = "off", "Off";
        /// Its orientation turns the head on top of the other sources.
        Head = "head", "Head";
        /// Its orientation and position are added to the other sources, in the axes of their pose.
        Pose = "pose", "Head and position";
        /// It replaces the other sources.
        Absolute = "absolute", "Absolute";
    }
}

choice! {
    /// Which listener group an instance belongs to.
    pub enum GroupChoice {
        /// None: a listener of its own.
        Off = "off", "Off";
        /// Group A.
        A = "a", "A";
        /// Group B.
        B = "b", "B";
        /// Group C.
        C = "c", "C";
        /// Group D.
        D = "d", "D";
    }
}

impl GroupChoice {
    /// Index of the group in the process, from 0; `None` without a group.
    #[must_use]
    pub fn number(self) -> Option<usize> {
        (self as usize).checked_sub(1)
    }
}

choice! {
    /// [`Tier`] as a parameter.
    pub enum TierChoice {
        /// [`Tier::Draft`].
        Draft = "draft", "Draft";
        /// [`Tier::Standard`].
        Standard = "standard", "Standard";
        /// [`Tier::High`].
        High = "high", "High";
        /// [`Tier::Reference`].
        Reference = "reference", "Reference";
    }
}

impl From<TierChoice> for Tier {
    fn from(choice: TierChoice) -> Self {
        Self::ALL[choice as usize]
    }
}

choice! {
    /// [`Latency`] as a parameter.
    pub enum LatencyChoice {
        /// [`Latency::Frame`].
        Frame = "frame", "Frame";
        /// [`Latency::Samples64`].
        Samples64 = "64", "64 samples";
        /// [`Latency::None`].
        None = "none", "None";
    }
}

impl From<LatencyChoice> for Latency {
    fn from(choice: LatencyChoice) -> Self {
        Self::ALL[choice as usize]
    }
}

choice! {
    /// Where the scene comes from.
    pub enum SceneChoice {
        /// The factory scene of room A.
        RoomA = "iosr-room-a", "IoSR room A";
        /// The factory scene of room B.
        RoomB = "iosr-room-b", "IoSR room B";
        /// The user's library, or the scene saved with the project.
        Library = "library", "Library";
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
    fn the_ids_of_the_tiers_are_their_names() {
        assert_eq!(TierChoice::ids().unwrap(), Tier::ALL.map(Tier::name));
        for (index, tier) in Tier::ALL.into_iter().enumerate() {
            assert_eq!(Tier::from(TierChoice::from_index(index)), tier);
        }
    }
}
