//! Where the listener's pose comes from: every source, and which takes precedence.
//!
//! In order of precedence: the leader of a listener group replaces everything; else an absolute tracker replaces knobs and
//! path; else the camera path, where one is followed, replaces the knobs or has them added; else the knobs, which are the
//! position and angle parameters. A head tracker turns the head on top of knobs and path.

use crate::parameter::choices::{Follow, Tracking};
use crate::project::walk::Walk;
use promenade_core::{Playback, Pose};

/// The sources of one block besides the group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sources {
    /// The pose that the position and angle parameters set.
    pub knobs: Pose,
    /// Whether a camera path is followed.
    pub follow: Follow,
    /// Share of the camera path that has been walked, 0 to 1.
    pub path_share: f64,
    /// Whether the knobs are added to the path's pose.
    pub offset: bool,
    /// How a head tracker is used.
    pub tracking: Tracking,
}

/// What the pose comes from in the end, besides a tracker on top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// The position and angle parameters.
    #[default]
    Knobs,
    /// The camera path.
    Path,
    /// The camera path with the parameters added.
    PathAndKnobs,
    /// A tracker alone.
    Tracker,
    /// The leader of the listener group.
    Group,
    /// The leader as it was saved, because none leads the group here.
    SavedLeader,
}

impl Sources {
    /// What the pose comes from, with or without a path and a tracker.
    pub fn base(&self, has_walk: bool, has_tracker: bool) -> Base {
        match (self.tracking, self.follow) {
            (Tracking::Absolute, _) if has_tracker => Base::Tracker,
            (_, Follow::Off) => Base::Knobs,
            _ if !has_walk => Base::Knobs,
            _ if self.offset => Base::PathAndKnobs,
            _ => Base::Path,
        }
    }

    /// The pose on a path at `time_s` of the transport; none where paths are not followed.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn on(&self, walk: &Walk, time_s: f64) -> Option<Pose> {
        match self.follow {
            Follow::Off => None,
            Follow::Position => Some(walk.path.pose_after(self.path_share * walk.path.duration_s(), Playback::default())),
            Follow::Transport => Some(walk.path.pose_after(time_s, walk.playback)),
        }
    }

    /// The pose at `time_s` of the transport.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn pose(&self, walk: Option<&Walk>, tracked: Option<&Pose>, time_s: f64) -> Pose {
        let on_path = |walk: &Walk| self.on(walk, time_s).unwrap_or(self.knobs);
        let base = match (self.base(walk.is_some(), tracked.is_some()), walk) {
            (Base::Path, Some(walk)) => on_path(walk),
            (Base::PathAndKnobs, Some(walk)) => {
                let path = on_path(walk);
                // World axes for the position, as the knobs are labelled; the head turns from where the path faces.
                Pose { position: path.position + self.knobs.position, ..compose(&path, &self.knobs) }
            }
            _ => self.knobs,
        };
        match (self.tracking, tracked) {
            (Tracking::Off, _) | (_, None) => base,
            (Tracking::Head, Some(tracked)) => Pose { position: base.position, ..compose(&base, tracked) },
            (Tracking::Pose, Some(tracked)) => compose(&base, tracked),
            (Tracking::Absolute, Some(tracked)) => *tracked,
        }
    }
}

/// A pose that is given in the axes of another.
fn compose(outer: &Pose, inner: &Pose) -> Pose {
    Pose {
        position: outer.position + outer.orientation * inner.position,
        orientation: (outer.orientation * inner.orientation).normalize(),
    }
}

#[cfg(test)]
pub(crate) mod tests;
