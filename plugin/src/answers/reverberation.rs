//! How much walls have to absorb for the reverberation times that are typed.

use crate::answers::settled::Question;
use promenade_acoustics::{Air, Shoebox};
use promenade_fault::with_causes;
use promenade_room::{Matched, Some7, match_t20};
use std::time::Duration;

/// Where the particles start, as shares of the lengths: the same for any emitter, so that moving one changes no wall.
const SOURCE: [f64; 3] = [0.31, 0.42, 0.45];
/// Seed of their scattering.
const SEED: u64 = 1;

/// A room of named materials, and the times that it is to have.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The room as its materials make it.
    pub walls: Shoebox,
    /// T20 by octave, seconds.
    pub t20_s: Some7,
}

impl Question for Wanted {
    type Answer = Result<Matched, String>;
    // A wall that is dragged is another room with each picture.
    const REST: Duration = Duration::from_millis(300);

    fn is_like(&self, other: &Self) -> bool {
        self == other
    }

    fn answer(&self, wanted: &dyn Fn() -> bool) -> Option<Self::Answer> {
        let source = std::array::from_fn(|a| SOURCE[a] * self.walls.size[a]);
        let found = match_t20(&self.walls, Air::default(), source, &self.t20_s, SEED).map_err(|e| with_causes(&e));
        wanted().then_some(found)
    }
}
