//! This host's own menu of a parameter, which plugins show in their editors.

/// What a line of the menu does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MenuAction {
    /// "Show automation".
    ShowAutomation,
    /// "Read automation", which is ticked.
    ReadAutomation,
    /// "Learn", in the menu "MIDI".
    MidiLearn,
    /// "Forget", in the same, which cannot be done.
    MidiForget,
}

impl MenuAction {
    /// All of them; a line's number is its place here, from 1.
    pub const ALL: [Self; 4] = [Self::ShowAutomation, Self::ReadAutomation, Self::MidiLearn, Self::MidiForget];

    /// The action of a line's number.
    pub(crate) fn of(number: u32) -> Option<Self> {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        Self::ALL.get(index).copied()
    }

    /// The number of its line.
    pub(crate) fn number(self) -> u32 {
        self as u32 + 1
    }
}
