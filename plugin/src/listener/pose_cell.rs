//! A pose that one thread writes and others read, without a lock.

use promenade_core::Pose;
use promenade_core::glam::{Quat, Vec3};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

/// Attempts of a reader that meets a writer.
const TRIES: usize = 8;

/// The newest pose with a time, seconds. One thread writes at a time; readers never wait for it.
///
/// A sequence lock: the version is odd while a write is under way, and a reader that saw it change tries again.
pub struct PoseCell {
    version: AtomicU32,
    time: AtomicU64,
    values: [AtomicU32; 7],
}

impl PoseCell {
    /// Holds nothing yet.
    pub(crate) const fn new() -> Self {
        Self { version: AtomicU32::new(0), time: AtomicU64::new(0), values: [const { AtomicU32::new(0) }; 7] }
    }

    /// Replaces the pose.
    ///
    /// # Real-time
    /// Any thread, one at a time; no allocation, lock or I/O.
    pub fn write(&self, time_s: f64, pose: &Pose) {
        let version = self.version.load(Ordering::Relaxed);
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        fence(Ordering::Release);
        self.time.store(time_s.to_bits(), Ordering::Relaxed);
        let values = pose.position.to_array().into_iter().chain(pose.orientation.to_array());
        for (cell, value) in self.values.iter().zip(values) {
            cell.store(value.to_bits(), Ordering::Relaxed);
        }
        self.version.store(version.wrapping_add(2), Ordering::Release);
    }

    /// The newest pose and its time; none before the first, or when a writer keeps being met.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn read(&self) -> Option<(f64, Pose)> {
        for _ in 0..TRIES {
            let before = self.version.load(Ordering::Acquire);
            if before == 0 {
                return None;
            }
            let time_s = f64::from_bits(self.time.load(Ordering::Relaxed));
            let [x, y, z, qx, qy, qz, qw] = std::array::from_fn(|i| f32::from_bits(self.values[i].load(Ordering::Relaxed)));
            fence(Ordering::Acquire);
            if before & 1 == 0 && self.version.load(Ordering::Relaxed) == before {
                let pose = Pose { position: Vec3::new(x, y, z), orientation: Quat::from_xyzw(qx, qy, qz, qw) };
                return Some((time_s, pose));
            }
            std::hint::spin_loop();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn a_pose_is_never_read_half_written() {
        let (cell, ends) = (Arc::new(PoseCell::new()), Arc::new(AtomicBool::new(false)));
        assert!(cell.read().is_none());
        let writer = {
            let (cell, ends) = (Arc::clone(&cell), Arc::clone(&ends));
            std::thread::spawn(move || {
                for v in (1..1_000_000).cycle().map(|i| i as f32) {
                    cell.write(f64::from(v), &Pose { position: Vec3::splat(v), orientation: Quat::from_xyzw(v, v, v, v) });
                    if ends.load(Ordering::Relaxed) {
                        break;
                    }
                }
            })
        };
        let mut seen = 0;
        while seen < 10_000 {
            if let Some((time_s, pose)) = cell.read() {
                let v = time_s as f32;
                assert_eq!((pose.position, pose.orientation), (Vec3::splat(v), Quat::from_xyzw(v, v, v, v)));
                seen += 1;
            }
        }
        ends.store(true, Ordering::Relaxed);
        writer.join().unwrap();
    }
}
