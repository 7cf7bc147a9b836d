//! The variants of the parameters that are choices. Their ids never change.

use nice_plug::prelude::Enum;
use promenade_core::Tier;

/// What moves the listener.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum Follow {
    /// The position and angle parameters.
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// The camera path, at the path position parameter.
    #[id = "position"]
    #[name = "Path position"]
    Position,
    /// The camera path, at the time of the host's transport.
    #[id = "transport"]
    #[name = "Transport"]
    Transport,
}

/// How a head tracker is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum Tracking {
    /// Not at all.
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// Its orientation turns the head on top of the other sources.
    #[id = "head"]
    #[name = "Head"]
    Head,
    /// Its orientation and position are added to the other sources, in the axes of their pose.
    #[id = "pose"]
    #[name = "Head and position"]
    Pose,
    /// It replaces the other sources.
    #[id = "absolute"]
    #[name = "Absolute"]
    Absolute,
}

/// Which listener group an instance belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum GroupChoice {
    /// None: a listener of its own.
    #[id = "off"]
    #[name = "Off"]
    Off,
    /// Group A.
    #[id = "a"]
    #[name = "A"]
    A,
    /// Group B.
    #[id = "b"]
    #[name = "B"]
    B,
    /// Group C.
    #[id = "c"]
    #[name = "C"]
    C,
    /// Group D.
    #[id = "d"]
    #[name = "D"]
    D,
}

impl GroupChoice {
    /// Index of the group in the process, from 0; `None` without a group.
    #[must_use]
    pub fn number(self) -> Option<usize> {
        (self as usize).checked_sub(1)
    }
}

/// [`Tier`] as a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum TierChoice {
    /// [`Tier::Draft`].
    #[id = "draft"]
    #[name = "Draft"]
    Draft,
    /// [`Tier::Standard`].
    #[id = "standard"]
    #[name = "Standard"]
    Standard,
    /// [`Tier::High`].
    #[id = "high"]
    #[name = "High"]
    High,
    /// [`Tier::Reference`].
    #[id = "reference"]
    #[name = "Reference"]
    Reference,
}

impl From<TierChoice> for Tier {
    fn from(choice: TierChoice) -> Self {
        match choice {
            TierChoice::Draft => Self::Draft,
            TierChoice::Standard => Self::Standard,
            TierChoice::High => Self::High,
            TierChoice::Reference => Self::Reference,
        }
    }
}

/// Where the scene comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Enum)]
pub enum SceneChoice {
    /// The factory scene of room A.
    #[id = "iosr-room-a"]
    #[name = "IoSR room A"]
    RoomA,
    /// The factory scene of room B.
    #[id = "iosr-room-b"]
    #[name = "IoSR room B"]
    RoomB,
    /// The user's library, or the scene saved with the project.
    #[id = "library"]
    #[name = "Library"]
    Library,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ids_of_the_tiers_are_their_names() {
        assert_eq!(TierChoice::ids().unwrap(), Tier::ALL.map(Tier::name));
        for (index, tier) in Tier::ALL.into_iter().enumerate() {
            assert_eq!(Tier::from(TierChoice::from_index(index)), tier);
        }
    }
}
