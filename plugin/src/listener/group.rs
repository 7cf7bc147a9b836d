//! Listener groups: one instance leads, the others of its project hear with its listener.
//!
//! The groups belong to the process: instances of a host that runs each plugin in a process of its own meet over Open Sound
//! Control instead, or follow what was saved ([`crate::project::leader`]).

use crate::listener::pose_cell::PoseCell;
use crate::parameter::cast::narrow;
use promenade_core::Pose;
use std::sync::atomic::{AtomicU64, Ordering};

/// Groups that have a leader in a process, of all projects.
const MOST_LED: usize = 32;
/// Poses that a group keeps; leaders publish one a hop.
const POSES: usize = 256;
/// A follower that is further than this behind or ahead of the leader's time, seconds, takes its newest pose: their times do
/// not belong together.
const UNRELATED_S: f64 = 0.5;
/// Nobody leads.
const NOBODY: u64 = 0;

static ALL: [Group; MOST_LED] = [const { Group::new() }; MOST_LED];
static NEXT_ID: AtomicU64 = AtomicU64::new(NOBODY + 1);

/// The poses of one leader over the time of the transport.
struct Group {
    leader: AtomicU64,
    /// The project's key of the group.
    key: AtomicU64,
    /// Poses published so far.
    count: AtomicU64,
    poses: [PoseCell; POSES],
}

impl Group {
    const fn new() -> Self {
        let (leader, key) = (AtomicU64::new(NOBODY), AtomicU64::new(0));
        Self { leader, key, count: AtomicU64::new(0), poses: [const { PoseCell::new() }; POSES] }
    }

    fn slot(&self, index: u64) -> &PoseCell {
        // The low bits are all that the remainder by a power of two needs.
        #[expect(clippy::cast_possible_truncation, reason = "truncation keeps the remainder")]
        &self.poses[index as usize % POSES]
    }

    fn newest(&self) -> Option<(f64, Pose)> {
        let count = self.count.load(Ordering::Acquire);
        self.slot(count.checked_sub(1)?).read()
    }

    /// The pose at a time, from the two published next to it; the ends hold.
    fn at(&self, time_s: f64) -> Option<Pose> {
        let count = self.count.load(Ordering::Acquire);
        let oldest = count.saturating_sub(POSES as u64 - 1);
        let mut later: Option<(f64, Pose)> = None;
        for index in (oldest..count).rev() {
            let Some((t_s, pose)) = self.slot(index).read() else { break };
            if t_s <= time_s {
                let Some((later_s, next)) = later else { return Some(pose) };
                let share = narrow((time_s - t_s) / (later_s - t_s));
                return Some(pose.toward(&next, share));
            }
            // A time that does not fall going back is from before the transport was moved.
            if later.is_some_and(|(later_s, _)| t_s >= later_s) {
                break;
            }
            later = Some((t_s, pose));
        }
        later.map(|(_, pose)| pose)
    }
}

/// The group of a key, if it has a leader.
fn led(key: u64) -> Option<&'static Group> {
    ALL.iter().find(|group| group.key.load(Ordering::Acquire) == key)
}

/// Whether the group of a key ([`ProjectId::group`](crate::project::project_id::ProjectId::group)) has a leader.
pub fn is_led(key: u64) -> bool {
    led(key).is_some()
}

/// One instance's place in the groups. The audio thread owns it.
pub struct Member {
    id: u64,
    leads: Option<(u64, &'static Group)>,
    /// By how much this instance is ahead of its leader, seconds: hosts process instances in any order.
    lag_s: f64,
}

impl Default for Member {
    fn default() -> Self {
        Self { id: NEXT_ID.fetch_add(1, Ordering::Relaxed), leads: None, lag_s: 0.0 }
    }
}

impl Member {
    /// Takes or leaves the lead of the group of a key. Returns whether this instance leads it; an earlier one keeps it.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn lead(&mut self, wanted: Option<u64>) -> bool {
        if self.leads.map(|(key, _)| key) != wanted {
            self.leave();
        }
        if let Some(key) = wanted.filter(|key| self.leads.is_none() && !is_led(*key)) {
            let is_ours =
                |group: &&Group| group.leader.compare_exchange(NOBODY, self.id, Ordering::AcqRel, Ordering::Acquire).is_ok();
            if let Some(group) = ALL.iter().find(is_ours) {
                group.count.store(0, Ordering::Release);
                group.key.store(key, Ordering::Release);
                self.leads = Some((key, group));
                // Of two that came at once the first keeps it.
                if !led(key).is_some_and(|first| std::ptr::eq(first, group)) {
                    self.leave();
                }
            }
        }
        self.leads()
    }

    /// Whether this instance leads a group.
    pub fn leads(&self) -> bool {
        self.leads.is_some()
    }

    /// Gives up the lead.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn leave(&mut self) {
        if let Some((_, group)) = self.leads.take() {
            group.key.store(0, Ordering::Release);
            group.leader.store(NOBODY, Ordering::Release);
        }
    }

    /// Publishes a pose at a time of the transport; does nothing without the lead.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn publish(&self, time_s: f64, pose: &Pose) {
        let Some((_, group)) = self.leads else { return };
        let count = group.count.load(Ordering::Relaxed);
        group.slot(count).write(time_s, pose);
        group.count.store(count + 1, Ordering::Release);
    }

    /// Prepares to follow the group of a key through a block that ends at `end_s`, seconds;
    /// `moved` when the transport was moved to it.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn follow(&mut self, key: u64, end_s: f64, moved: bool) -> Option<Following> {
        let group = led(key)?;
        let (newest_s, newest) = group.newest()?;
        let behind_s = end_s - newest_s;
        if moved {
            self.lag_s = 0.0;
        }
        if behind_s.abs() > UNRELATED_S {
            return Some(Following { group, lag_s: 0.0, held: Some(newest) });
        }
        self.lag_s = self.lag_s.max(behind_s);
        Some(Following { group, lag_s: self.lag_s, held: None })
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        self.leave();
    }
}

/// A leader's listener during one block.
pub struct Following {
    group: &'static Group,
    lag_s: f64,
    held: Option<Pose>,
}

impl Following {
    /// The leader's pose at a time of the transport, at most a block late.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn pose(&self, time_s: f64) -> Option<Pose> {
        self.held.or_else(|| self.group.at(time_s - self.lag_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::glam::Vec3;

    const SAMPLE_S: f64 = 1.0 / 48_000.0;

    fn at_x(x: f64) -> Pose {
        Pose { position: Vec3::new(x as f32, 0.0, 0.0), ..Pose::IDENTITY }
    }

    /// A second along x is a metre.
    fn walk(leader: &Member, start_s: f64, samples: usize) {
        for sample in (0..samples).step_by(256).chain([samples]) {
            let time_s = start_s + sample as f64 * SAMPLE_S;
            leader.publish(time_s, &at_x(time_s));
        }
    }

    #[test]
    fn a_follower_walks_with_its_leader_whoever_comes_first() {
        for (group, leader_first) in [(9, true), (10, false)] {
            let (mut leader, mut follower) = (Member::default(), Member::default());
            assert!(leader.lead(Some(group)));
            let block = 8192;
            let block_s = block as f64 * SAMPLE_S;
            for n in 0..6 {
                let start_s = n as f64 * block_s;
                if leader_first {
                    walk(&leader, start_s, block);
                }
                let following = follower.follow(group, start_s + block_s, false);
                for i in (0..block).step_by(100) {
                    let time_s = start_s + i as f64 * SAMPLE_S;
                    let x = following.as_ref().and_then(|f| f.pose(time_s)).map(|pose| f64::from(pose.position.x));
                    let wanted = if leader_first { time_s } else { time_s - block_s };
                    if leader_first || n > 1 {
                        assert!((x.unwrap() - wanted).abs() < 1e-4, "{x:?} {wanted}");
                    }
                }
                if !leader_first {
                    walk(&leader, start_s, block);
                }
            }
        }
    }

    #[test]
    fn one_leads_and_the_next_takes_over_when_it_goes() {
        let (mut first, mut second) = (Member::default(), Member::default());
        assert!(first.lead(Some(11)) && !second.lead(Some(11)));
        assert!(is_led(11));
        drop(first);
        assert!(!is_led(11));
        assert!(second.follow(11, 0.0, false).is_none(), "nobody leads");
        assert!(second.lead(Some(11)));
        assert!(!second.lead(None));
        assert!(!is_led(11));
    }

    #[test]
    fn a_leader_at_another_time_is_heard_where_it_is_now() {
        let (mut leader, mut follower) = (Member::default(), Member::default());
        leader.lead(Some(12));
        leader.publish(100.0, &at_x(7.0));
        let pose = follower.follow(12, 3.0, false).unwrap().pose(3.0).unwrap();
        assert!((pose.position.x - 7.0).abs() < 1e-6);
    }
}
