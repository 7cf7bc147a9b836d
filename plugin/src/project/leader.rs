//! What moved the leader of an instance's group when its project was saved: a follower that is frozen or bounced alone hears
//! with that.

use crate::listener::pose_sources::Sources;
use crate::listener::snapshot::sources_of;
use crate::parameter::Parameter;
use crate::parameter::choices::Tracking;
use crate::project::params::PromenadeParams;
use crate::project::persisted::Persisted;
use crate::project::walk::{SavedWalk, Walk};
use crate::telemetry::members;
use nice_plug::params::persist::PersistentField;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The parameters that move a listener.
const MOVING: [Parameter; 9] = [
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
    /// Plain values of position, angles, place on the path, how that is followed, and whether position and angles are added.
    values: [f32; MOVING.len()],
    walk: SavedWalk,
}

/// The same, ready for the audio thread.
pub struct Leader {
    /// What moves it.
    pub sources: Sources,
    /// Its camera path.
    pub walk: Option<Walk>,
}

impl SavedLeader {
    /// That of an instance as it is now.
    #[must_use]
    pub fn of(params: &PromenadeParams) -> Self {
        Self { values: MOVING.map(|parameter| params.heard(parameter)), walk: params.saved_walk.get().0 }
    }

    /// Ready to be followed; a path that is none leaves the position.
    #[must_use]
    pub fn ready(&self) -> Arc<Leader> {
        let value = |parameter: Parameter| {
            let known = MOVING.iter().position(|moving| *moving == parameter).map(|at| self.values[at]);
            parameter.clamp(known.unwrap_or(0.0))
        };
        let sources = Sources { tracking: Tracking::Off, ..sources_of(value) };
        Arc::new(Leader { sources, walk: self.walk.to_walk().ok().flatten() })
    }
}

/// The leader as projects keep it: with each saving the one that the group has then.
#[derive(Default)]
pub struct GroupLeader(pub(crate) Persisted<Option<SavedLeader>>);

impl PersistentField<'_, Option<SavedLeader>> for GroupLeader {
    fn set(&self, saved: Option<SavedLeader>) {
        self.0.restore(saved);
    }

    fn map<F, R>(&self, done: F) -> R
    where
        F: Fn(&Option<SavedLeader>) -> R,
    {
        // Without a leader here, as in a process of its own, the one that was saved is kept.
        let now = members::leader_of(self);
        done(&now.unwrap_or_else(|| self.0.get().0))
    }
}
