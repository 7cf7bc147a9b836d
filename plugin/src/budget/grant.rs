//! How much of itself an instance may play.

/// What an instance may play within the budget, cheapest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grant {
    /// Nothing: it waits, and comes back without a click.
    Nothing,
    /// The direct sound.
    Draft,
    /// All that is set.
    #[default]
    Full,
}

impl Grant {
    /// All of them, cheapest first.
    pub const ALL: [Self; 3] = [Self::Nothing, Self::Draft, Self::Full];

    /// That of an index in [`Grant::ALL`]; all for one beyond.
    pub(super) fn of_index(index: u8) -> Self {
        Self::ALL.get(usize::from(index)).copied().unwrap_or_default()
    }

    /// Its name for a reader.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "Waits",
            Self::Draft => "Draft",
            Self::Full => "Full",
        }
    }
}
