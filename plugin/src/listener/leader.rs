//! A leader as it was saved, to be followed where none leads the group.

use crate::listener::{pose_sources::Sources, snapshot::sources_of};
use crate::parameter::{Parameter, choices::Tracking};
use crate::project::leader::{MOVING, SavedLeader};
use crate::project::walk::Walk;

/// What moves it, ready for the audio thread.
pub struct Leader {
    /// Position, angles, and how its camera path is followed.
    pub sources: Sources,
    /// The camera path.
    pub walk: Option<Walk>,
}

impl From<&SavedLeader> for Leader {
    /// A path that is none leaves the position.
    fn from(saved: &SavedLeader) -> Self {
        let value = |parameter: Parameter| {
            let known = MOVING.iter().position(|moving| *moving == parameter).map(|at| saved.values[at]);
            parameter.clamp(known.unwrap_or(0.0))
        };
        let sources = Sources { tracking: Tracking::Off, ..sources_of(value) };
        Self { sources, walk: saved.walk.to_walk().ok().flatten() }
    }
}
