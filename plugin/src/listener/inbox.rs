//! A tracker's poses on their way to the audio thread.

use crate::listener::pose_cell::PoseCell;
use promenade_core::Pose;
use std::sync::atomic::{AtomicU8, Ordering};

/// There is no tracker.
const NOBODY: u8 = 2;
/// Attempts of a reader that is overtaken by newer poses while it reads.
const TRIES: usize = 16;

/// The newest pose of a tracker, from the network thread to the audio thread.
///
/// Two cells take turns, so that a reader is not met by the writer of the newest pose, however fast a tracker sends.
pub struct Inbox {
    tracked: [PoseCell; 2],
    newest: AtomicU8,
}

impl Default for Inbox {
    fn default() -> Self {
        Self { tracked: [const { PoseCell::new() }; 2], newest: AtomicU8::new(NOBODY) }
    }
}

impl Inbox {
    /// Takes a tracker's pose, mapped to the head's axes and recentred. One thread at a time calls it.
    ///
    /// A tracker that sends no position stands at the origin, one that sends no orientation faces ahead.
    pub fn track(&self, pose: &Pose) {
        let next = u8::from(self.newest.load(Ordering::Relaxed) == 0);
        self.tracked[usize::from(next)].write(0.0, pose);
        self.newest.store(next, Ordering::Release);
    }

    /// Forgets the tracker.
    pub fn lose(&self) {
        self.newest.store(NOBODY, Ordering::Release);
    }

    /// The tracker's newest pose, if there is a tracker.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub fn tracked(&self) -> Option<Pose> {
        for _ in 0..TRIES {
            let newest = self.newest.load(Ordering::Acquire);
            // Out of the array: nobody.
            let read = self.tracked.get(usize::from(newest))?.read();
            // A cell that is not the newest any more may already hold the pose after next, and the next call would step back.
            if let Some((_, pose)) = read
                && self.newest.load(Ordering::Acquire) == newest
            {
                return Some(pose);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_core::glam::{Quat, Vec3};
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn the_newest_pose_is_read_whole_while_the_next_is_written() {
        let (inbox, done) = (Arc::new(Inbox::default()), Arc::new(AtomicBool::new(false)));
        assert_eq!(inbox.tracked(), None);
        let at = |i: u32| Pose { position: Vec3::splat(i as f32), orientation: Quat::from_xyzw(0.0, 0.0, 0.0, i as f32) };
        inbox.track(&at(1));
        let reader = {
            let (inbox, done) = (Arc::clone(&inbox), Arc::clone(&done));
            std::thread::spawn(move || {
                let (mut reads, mut last) = (0_u64, 0.0);
                while !done.load(Ordering::Acquire) {
                    let pose = inbox.tracked().expect("a tracker is there all the time");
                    assert_eq!(pose.position, Vec3::splat(pose.orientation.w));
                    assert!(pose.position.x >= last);
                    (reads, last) = (reads + 1, pose.position.x);
                }
                reads
            })
        };
        for i in 2..100_000 {
            inbox.track(&at(i));
            (0..200).for_each(|_| std::hint::spin_loop());
        }
        done.store(true, Ordering::Release);
        assert!(reader.join().unwrap() > 0);
        assert_eq!(inbox.tracked(), Some(at(99_999)));
        inbox.lose();
        assert_eq!(inbox.tracked(), None);
    }
}
