//! What moved the leader of an instance's group when its project was saved: a follower that is frozen or bounced alone hears
//! with that.

use crate::parameter::Parameter;
use crate::project::{persisted::Persisted, walk::SavedWalk};
use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// The parameters that move a listener.
pub const MOVING: [Parameter; 9] = [
    Parameter::X,
    Parameter::Y,
    Parameter::Z,
    Parameter::Yaw,
    Parameter::Pitch,
    Parameter::Roll,
    Parameter::Path,
    Parameter::Follow,
    Parameter::Offset,
];

/// A leader's position, angles and camera path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SavedLeader {
    /// Plain values of [`MOVING`].
    pub values: [f32; MOVING.len()],
    /// The camera path.
    pub walk: SavedWalk,
}

/// Finds the leader that an instance follows now: none for one that leads or is in no group; nothing without a leader here.
type Find = Box<dyn Fn() -> Option<Option<SavedLeader>> + Send + Sync>;

/// The leader as projects keep it: with each saving the one that the group has then.
#[derive(Default)]
pub struct GroupLeader {
    /// As it was saved.
    pub saved: Persisted<Option<SavedLeader>>,
    find: OnceLock<Find>,
}

impl GroupLeader {
    /// Has the leader found when the project is saved; only the first way counts.
    pub fn find_by(&self, find: impl Fn() -> Option<Option<SavedLeader>> + Send + Sync + 'static) {
        let _first = self.find.set(Box::new(find));
    }
}

impl PersistentField<'_, Option<SavedLeader>> for GroupLeader {
    fn set(&self, saved: Option<SavedLeader>) {
        self.saved.restore(saved);
    }

    fn map<F: Fn(&Option<SavedLeader>) -> R, R>(&self, done: F) -> R {
        // Without a leader here, as in a process of its own, the one that was saved is kept.
        let now = self.find.get().and_then(|find| find());
        done(&now.unwrap_or_else(|| self.saved.get().0))
    }
}
