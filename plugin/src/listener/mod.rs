//! The listener of an instance, block by block, from all sources of its pose.

pub mod clock;
pub mod group;
pub mod inbox;
pub mod leader;
pub mod pose_cell;
pub mod pose_sources;
pub(crate) mod ramp;
pub mod snapshot;
pub(crate) mod source_paths;

use crate::listener::group::{Following, Member};
use crate::listener::pose_sources::{Base, Sources};
use crate::listener::{clock::BlockTime, inbox::Inbox, leader::Leader, snapshot::Snapshot, source_paths::SourcePaths};
use crate::parameter::{cast::narrow, choices::Tracking};
use crate::project::walk::Walk;
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use std::sync::Arc;

/// Time constant with which a tracker's steps are smoothed, seconds: trackers send 30 to 100 poses a second, hops are shorter.
const GLIDE_S: f64 = 0.015;

/// Follows the steps of a tracker smoothly.
#[derive(Clone, Copy, Debug, Default)]
pub struct Glide {
    pose: Option<Pose>,
}

impl Glide {
    /// The smoothed pose `past_s` seconds after it was last asked; the first is taken as it is.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn follow(&mut self, target: &Pose, past_s: f64) -> Pose {
        let next = match self.pose {
            Some(from) => from.toward(target, narrow(1.0 - (-past_s / GLIDE_S).exp())),
            None => *target,
        };
        self.pose = Some(next);
        next
    }

    /// The next pose is taken at once.
    pub fn jump(&mut self) {
        self.pose = None;
    }
}

/// The sources of an instance's listener that last from block to block. The audio thread owns them.
#[derive(Default)]
pub(crate) struct ListenerSources {
    inbox: Arc<Inbox>,
    pub(crate) glide: Glide,
    pub(crate) member: Member,
}

impl ListenerSources {
    /// A tracker's poses come from `inbox`.
    pub(crate) fn new(inbox: Arc<Inbox>) -> Self {
        Self { inbox, ..Self::default() }
    }

    /// The listener of a block, which leads or follows its group. Where there are values from which the block's own are moved
    /// to, `from` has them.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn of_block<'a, const FURTHER: usize>(
        &'a mut self,
        snapshot: &Snapshot<FURTHER>,
        from: Option<&Snapshot<FURTHER>>,
        (walk, leader, paths): (Option<&'a Walk>, Option<&'a Leader>, SourcePaths<'a>),
        time: &BlockTime,
        sample_rate_hz: f64,
    ) -> Listener<'a> {
        if time.moved {
            self.glide.jump();
        }
        let leads = self.member.lead(snapshot.group.filter(|_| snapshot.leads));
        let group = snapshot.group.filter(|_| !leads);
        Listener {
            sources: snapshot.sources,
            from: from.map(|from| from.sources),
            length_s: time.length_s,
            walk,
            paths,
            tracked: self.inbox.tracked(),
            glide: &mut self.glide,
            leader: leader.filter(|_| group.is_some()),
            following: group.and_then(|group| self.member.follow(group, time.end_s(), time.moved)),
            member: &self.member,
            start_s: time.start_s,
            sample_s: sample_rate_hz.recip(),
            glided: Glided::default(),
        }
    }
}

/// The listener at the end of a block, as an editor shows it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeardPose {
    /// The pose, from all sources.
    pub(crate) pose: Pose,
    /// What it comes from.
    pub(crate) base: Base,
    /// Whether a head tracker turns or moves it.
    pub(crate) tracked: bool,
    /// Whether this instance leads its listener group.
    pub(crate) leads: bool,
    /// How far its path takes the first source from the scene's emitter, metres.
    pub(crate) source_offset: Vec3,
}

/// The listener during one block.
pub struct Listener<'a> {
    /// The sources besides the group.
    pub sources: Sources,
    /// The sources besides the group at the first sample, from which they move to `sources` over the block; none where they are
    /// so from the beginning.
    pub from: Option<Sources>,
    /// Length of the block, seconds.
    pub length_s: f64,
    /// The camera path, if there is one.
    pub walk: Option<&'a Walk>,
    /// The paths of sources.
    pub(crate) paths: SourcePaths<'a>,
    /// The tracker's newest pose, if there is one.
    pub tracked: Option<Pose>,
    /// Smooths the tracker.
    pub glide: &'a mut Glide,
    /// The group's leader, where this instance follows one.
    pub following: Option<Following>,
    /// What is followed where nobody leads the group.
    pub leader: Option<&'a Leader>,
    /// This instance's place in the groups.
    pub member: &'a Member,
    /// Time of the transport at the first sample, seconds.
    pub start_s: f64,
    /// Length of a sample, seconds.
    pub sample_s: f64,
    /// What the tracker was smoothed to.
    pub glided: Glided,
}

/// Samples of a block whose poses several renderers may ask for one after the other.
const KEPT: usize = 32;

/// The last smoothed poses of a tracker in a block, by sample, so that several renderers hear the same.
#[derive(Clone, Copy, Debug, Default)]
pub struct Glided {
    kept: [Option<(usize, Pose)>; KEPT],
    newest: usize,
}

impl Glided {
    /// The pose that is kept for a sample, or the one before it; none for a sample after all of them.
    fn at(&self, sample: usize) -> Option<Pose> {
        let is_old = self.kept[self.newest].is_some_and(|(newest, _)| sample <= newest);
        let kept = self.kept.iter().flatten().filter(|_| is_old);
        let before = kept.clone().filter(|(at, _)| *at <= sample).max_by_key(|(at, _)| *at);
        before.or_else(|| kept.min_by_key(|(at, _)| *at)).map(|(_, pose)| *pose)
    }

    /// Samples from the newest to this one, which is after it.
    fn since(&self, sample: usize) -> usize {
        sample - self.kept[self.newest].map_or(0, |(newest, _)| newest.min(sample))
    }

    fn keep(&mut self, sample: usize, pose: Pose) {
        self.newest = (self.newest + 1) % KEPT;
        self.kept[self.newest] = Some((sample, pose));
    }
}

impl Listener<'_> {
    /// Time of the transport at a sample of the block, seconds.
    fn time_s(&self, sample: usize) -> f64 {
        self.start_s + sample as f64 * self.sample_s
    }

    /// The pose at a sample, which is published to the group that this instance leads. Samples are asked for in rising order,
    /// by one renderer after the other in a stretch of the block.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn pose(&mut self, sample: usize) -> Pose {
        self.publish(sample, self.time_s(sample))
    }

    /// The listener after the last of so many samples, at `end_s` of the transport.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(crate) fn end(&mut self, samples: usize, end_s: f64) -> HeardPose {
        let pose = self.publish(samples, end_s);
        let has_tracker = self.tracked.is_some();
        let (base, tracked) = match (&self.following, self.leader) {
            (Some(_), _) => (Base::Group, false),
            (None, Some(_)) => (Base::SavedLeader, false),
            (None, None) => {
                (self.sources.base(self.walk.is_some(), has_tracker), has_tracker && self.sources.tracking != Tracking::Off)
            }
        };
        HeardPose { pose, base, tracked, leads: self.member.leads(), source_offset: self.source_offset(0, samples) }
    }

    /// The sources at a sample of the block.
    fn sources_at(&self, sample: usize) -> Sources {
        let Some(from) = &self.from else { return self.sources };
        let share = (sample as f64 * self.sample_s / self.length_s.max(self.sample_s)).min(1.0);
        Sources {
            knobs: from.knobs.toward(&self.sources.knobs, narrow(share)),
            path_share: from.path_share + share * (self.sources.path_share - from.path_share),
            ..self.sources
        }
    }

    fn publish(&mut self, sample: usize, published_s: f64) -> Pose {
        let time_s = self.time_s(sample);
        let saved = || self.leader.map(|leader| leader.sources.pose(leader.walk.as_ref(), None, time_s));
        let pose = self.following.as_ref().and_then(|f| f.pose(time_s)).or_else(saved).unwrap_or_else(|| {
            let tracked = self.tracked.map(|target| self.smoothed(&target, sample));
            self.sources_at(sample).pose(self.walk, tracked.as_ref(), time_s)
        });
        self.member.publish(published_s, &pose);
        pose
    }

    /// The tracker's pose at a sample: smoothed once, however many ask.
    fn smoothed(&mut self, target: &Pose, sample: usize) -> Pose {
        self.glided.at(sample).unwrap_or_else(|| {
            let pose = self.glide.follow(target, self.glided.since(sample) as f64 * self.sample_s);
            self.glided.keep(sample, pose);
            pose
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::listener::pose_sources::tests::{at, check};

    #[test]
    fn a_glide_reaches_its_target_and_jumps_on_demand() {
        let mut glide = Glide::default();
        check(glide.follow(&at(0.0, 0.0), 0.005), 0.0, 0.0);
        let first = glide.follow(&at(1.0, 1.0), 0.005).position.x;
        assert!(first > 0.2 && first < 0.4, "{first}");
        for _ in 0..100 {
            glide.follow(&at(1.0, 1.0), 0.005);
        }
        check(glide.follow(&at(1.0, 1.0), 0.005), 1.0, 1.0);
        glide.jump();
        check(glide.follow(&at(-4.0, 0.0), 0.005), -4.0, 0.0);
    }

    #[test]
    fn whoever_asks_again_hears_the_same() {
        let mut glided = Glided::default();
        assert!(glided.at(0).is_none() && glided.since(100) == 100);
        glided.keep(100, at(1.0, 0.0));
        glided.keep(340, at(2.0, 0.0));
        assert_eq!(glided.since(400), 60);
        assert!(glided.at(341).is_none());
        for (sample, expected) in [(340, 2.0), (339, 1.0), (100, 1.0), (0, 1.0)] {
            check(glided.at(sample).unwrap(), expected, 0.0);
        }
    }
}

#[cfg(test)]
mod sound_tests;
