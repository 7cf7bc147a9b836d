//! Poses, a walk and a sound that are the same on every machine.

use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use std::f32::consts::{FRAC_PI_2, PI};

/// Highest pitch of a random pose up and down, radians.
const PITCH: f32 = PI / 6.0;

/// The first pose, and others at random places within bounds: any yaw, a pitch within 30 degrees, no roll.
#[must_use]
pub fn poses_within(bounds: (Vec3, Vec3), first: Pose, count: usize, seed: u64) -> Vec<Pose> {
    let mut random = Random::new(seed);
    let mut other = || {
        let mut between = |low: f32, high: f32| low + (high - low) * random.uniform();
        let ((low, high), turn) = (bounds, between(-PI, PI));
        let place = Vec3::new(between(low.x, high.x), between(low.y, high.y), between(low.z, high.z));
        Pose::from_ypr(place, turn, between(-PITCH, PITCH), 0.0)
    };
    (0..count).map(|i| if i == 0 { first } else { other() }).collect()
}

/// Two metres there and back at 1 m/s, so that a long walk stays near the measured poses, while turning by 90 degrees a second.
#[must_use]
pub fn walk(start: &Pose, seconds: f64) -> Pose {
    let t = seconds as f32;
    let there = 1.0 - (t.rem_euclid(4.0) - 2.0).abs();
    Pose::from_ypr(start.position + Vec3::X * there, t * FRAC_PI_2, 0.0, 0.0)
}

/// Uniform noise in [-0.5, 0.5), the same on every machine.
#[must_use]
pub fn noise(len: usize) -> Vec<f32> {
    let mut random = Random::new(1);
    (0..len).map(|_| random.uniform() - 0.5).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_begin_at_the_first_and_stay_inside() {
        let (low, high) = (Vec3::new(-1.0, 2.0, 0.5), Vec3::new(1.0, 5.0, 0.5));
        let poses = poses_within((low, high), Pose::IDENTITY, 20, 1);
        assert_eq!((poses.len(), poses[0]), (20, Pose::IDENTITY));
        for pose in &poses[1..] {
            let (_, pitch, roll) = pose.ypr();
            assert!(pose.position.cmpge(low).all() && pose.position.cmple(high).all(), "{pose:?}");
            assert!(pitch.abs() < PITCH + 1e-5 && roll.abs() < 1e-5 && pose.is_valid(), "{pose:?}");
        }
        assert_ne!(poses[1], poses[2]);
        assert_eq!(poses, poses_within((low, high), Pose::IDENTITY, 20, 1));
    }
}
