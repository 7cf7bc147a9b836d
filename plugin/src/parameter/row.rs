//! What there is to know about a parameter beside its value.

use crate::parameter::choices::Choice;

/// Number of library files that a slot parameter can choose from.
pub const SLOTS: u8 = 64;

/// A parameter's row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The id in saved states, in presets and in addresses of Open Sound Control; it never changes.
    pub id: &'static str,
    /// The name that hosts show.
    pub name: &'static str,
    /// The module in which hosts show it.
    pub module: &'static str,
    /// The values that it may have.
    pub values: Values,
    /// The plain value of a new instance.
    pub default: f32,
    /// The word beside its control in the editor.
    pub label: &'static str,
    /// What it does, for its tooltip.
    pub help: &'static str,
}

/// Which plain values a parameter may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Values {
    /// Numbers in a unit, from the least to the greatest.
    Number(Unit, f32, f32),
    /// 0 for off, 1 for on.
    Switch,
    /// The number of a file of the library, 1 to [`SLOTS`]; 0 for the one saved with the project.
    Slot(SlotKind),
    /// The index of a variant.
    Choice(Choice),
}

/// What the files of a slot parameter are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotKind {
    /// Scenes.
    Scene,
    /// Camera paths.
    Walk,
}

/// What a number counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    Metre,
    /// Degrees.
    Degree,
    /// A share of 1, written in per cent.
    Share,
    /// Hertz.
    Hertz,
    /// Decibels.
    Decibel,
}

impl Unit {
    /// As it stands behind a number, with the space between them.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Metre => " m",
            Self::Degree => " deg",
            Self::Share => " %",
            Self::Hertz => " Hz",
            Self::Decibel => " dB",
        }
    }

    /// Digits behind the point, as hosts show them.
    pub fn digits(self) -> usize {
        match self {
            Self::Metre => 3,
            Self::Hertz => 1,
            Self::Degree | Self::Share | Self::Decibel => 2,
        }
    }
}

/// A place along one axis, or how far something is moved.
pub(super) const METRES: Values = Values::Number(Unit::Metre, -50.0, 50.0);
/// A level; of those that are silent at the least, the rows say so.
pub(super) const LEVEL: Values = Values::Number(Unit::Decibel, -60.0, 12.0);
/// A full turn.
pub(super) const TURN: Values = Values::Number(Unit::Degree, -180.0, 180.0);
/// From straight below to straight above.
pub(super) const QUARTER: Values = Values::Number(Unit::Degree, -90.0, 90.0);
/// A distance.
pub(super) const AWAY: Values = Values::Number(Unit::Metre, 0.0, 100.0);
/// A share of a whole.
pub(super) const WHOLE: Values = Values::Number(Unit::Share, 0.0, 1.0);
