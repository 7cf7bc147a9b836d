//! Poses, a walk and a sound that are the same on every machine.

use promenade_core::glam::Vec3;
use promenade_core::random::Random;
use promenade_core::{Pose, Scene};
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

/// Poses at which a listener stands, and ways that he takes, the same on every machine.
#[derive(Clone, Debug)]
pub struct Course {
    /// Where he stands.
    pub poses: Vec<Pose>,
    /// Where he walks and turns.
    pub ways: Vec<Way>,
}

/// A way of a listener: two metres there and back at 1 m/s while the head turns.
#[derive(Clone, Debug)]
pub struct Way {
    middle: Pose,
    along: Vec3,
    /// Radians a second.
    turn: f32,
}

/// Poses whose responses take about as long to play as a way.
const POSES_A_WAY: usize = 4;
/// Turn of the head while tones are held, radians a second.
const SLOW_TURN: f32 = PI / 6.0;

impl Course {
    /// Some poses within a scene's bounds, its start pose the first, and some ways: one about the start pose, or with a seed
    /// above 1 all about others and in other directions.
    #[must_use]
    pub fn new(scene: &Scene, poses: usize, ways: usize, seed: u64) -> Self {
        let poses = poses_within(scene.bounds(), scene.start_pose(), poses, seed);
        let mut random = Random::new(seed.wrapping_add(1));
        let mut way = |(n, middle): (usize, &Pose)| {
            let (angle, turn) = (2.0 * PI * random.uniform(), (0.5 + 1.5 * random.uniform()) * FRAC_PI_2);
            let middle = Pose::from_ypr(middle.position, middle.ypr().0, 0.0, 0.0);
            match (n, seed) {
                (0, 1) => Way { middle, along: Vec3::X, turn: FRAC_PI_2 },
                _ => Way { middle, along: Vec3::new(angle.cos(), angle.sin(), 0.0), turn },
            }
        };
        let ways = poses.iter().skip(usize::from(seed > 1)).take(ways).enumerate().map(&mut way).collect();
        Self { poses, ways }
    }

    /// Its parts in order, each of which takes about as long to play as a way.
    pub(crate) fn parts(&self) -> Vec<Self> {
        let standing = self.poses.chunks(POSES_A_WAY).map(|poses| Self { poses: poses.to_vec(), ways: Vec::new() });
        let moving = self.ways.iter().map(|way| Self { poses: Vec::new(), ways: vec![way.clone()] });
        standing.chain(moving).collect()
    }
}

impl Way {
    /// The pose some seconds after its beginning.
    #[must_use]
    pub fn walked(&self, seconds: f64) -> Pose {
        let (yaw, ..) = self.middle.ypr();
        let position = self.middle.position + there_and_back(seconds) * self.along;
        Pose::from_ypr(position, yaw + seconds as f32 * self.turn, 0.0, 0.0)
    }

    /// The pose of a head that turns slowly at its middle.
    #[must_use]
    pub fn turned(&self, seconds: f64) -> Pose {
        let (yaw, ..) = self.middle.ypr();
        Pose::from_ypr(self.middle.position, yaw + seconds as f32 * SLOW_TURN, 0.0, 0.0)
    }
}

fn there_and_back(seconds: f64) -> f32 {
    1.0 - ((seconds as f32).rem_euclid(4.0) - 2.0).abs()
}

/// Two metres there and back at 1 m/s, so that a long walk stays near the measured poses, while turning by 90 degrees a second.
#[must_use]
pub fn walk(start: &Pose, seconds: f64) -> Pose {
    Pose::from_ypr(start.position + Vec3::X * there_and_back(seconds), seconds as f32 * FRAC_PI_2, 0.0, 0.0)
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
