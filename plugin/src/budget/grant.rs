//! How much of itself an instance may play.

use crate::parameter::choices::AccuracyChoice;
use nice_plug::prelude::Enum;

/// Accuracies that there are.
const ACCURACIES: u8 = 5;

/// What an instance may play within the budget: nothing, or its scene within an error. The cheapest is the least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Grant(u8);

impl Grant {
    /// Nothing: it waits, and comes back without a click.
    pub const WAITS: Self = Self(0);
    /// The least that is more than nothing.
    pub const LEAST: Self = Self(1);
    /// All that is set.
    pub const FULL: Self = Self(ACCURACIES);
    /// How many there are.
    pub const COUNT: usize = ACCURACIES as usize + 1;

    /// All of them, cheapest first.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..=ACCURACIES).map(Self)
    }

    /// That of an index among [`Grant::all`]; all for one beyond.
    pub(super) fn of_index(index: u8) -> Self {
        Self(index.min(ACCURACIES))
    }

    pub(super) fn index(self) -> u8 {
        self.0
    }

    /// How near to all of the scene it is played; `None` for one that waits.
    pub fn accuracy(self) -> Option<AccuracyChoice> {
        (self > Self::WAITS).then(|| AccuracyChoice::from_index(usize::from(ACCURACIES - self.0)))
    }

    /// Its name for a reader.
    pub fn name(self) -> &'static str {
        self.accuracy().map_or("Waits", |accuracy| AccuracyChoice::variants()[accuracy as usize])
    }
}

impl From<AccuracyChoice> for Grant {
    fn from(accuracy: AccuracyChoice) -> Self {
        Self(ACCURACIES - accuracy as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grants_rise_from_nothing_to_all() {
        assert_eq!(
            Grant::all().map(Grant::name).collect::<Vec<_>>(),
            ["Waits", "2 JND", "1 JND", "0.5 JND", "0.25 JND", "All"]
        );
        assert_eq!(Grant::from(AccuracyChoice::All), Grant::FULL);
        assert!(Grant::all().skip(1).all(|grant| grant.accuracy().map(Grant::from) == Some(grant)));
    }
}
