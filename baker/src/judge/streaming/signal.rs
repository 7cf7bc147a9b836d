//! Sound and poses that are the same on every machine.

use crate::signal::random::Random;
use promenade_core::glam::Vec3;
use promenade_core::{AnchorCloud, Pose, StftGrid};
use std::f32::consts::{PI, TAU};

/// From one burst or click to the next, seconds.
const EVERY_S: f64 = 0.125;
/// Length of a noise burst, seconds.
const BURST_S: f64 = 0.06;
/// Time in which a click falls by 60 dB, seconds.
const CLICK_T60_S: f32 = 0.05;
/// Frequencies of the clicks as shares of the sample rate, one after the other.
const CLICKS: [f32; 5] = [0.01, 0.02, 0.04, 0.08, 0.16];
/// Highest pitch of a random pose up and down, radians.
const PITCH: f32 = PI / 6.0;

/// The sound that streams are compared on unless there is another: bursts and clicks of 3 s, or of 3 clips where those are longer.
#[must_use]
pub fn test_sound(grid: &StftGrid, cloud: &AnchorCloud) -> Vec<f32> {
    let clip_s = cloud.model.sizes().frames as f64 * grid.hop_s();
    bursts_and_clicks(grid.sample_rate_hz, 3.0_f64.max(3.0 * clip_s))
}

/// Bursts of white noise and clicks of decaying tones in turn, full scale 0.5.
#[must_use]
pub fn bursts_and_clicks(sample_rate_hz: f64, seconds: f64) -> Vec<f32> {
    let samples = |s: f64| ((s * sample_rate_hz) as usize).max(1);
    let (every, burst) = (samples(EVERY_S), samples(BURST_S));
    let fall = 6.91 / (CLICK_T60_S * sample_rate_hz as f32);
    let mut random = Random::new(1);
    let at = |i: usize, random: &mut Random| {
        let (event, n) = (i / every, i % every);
        if event.is_multiple_of(2) {
            let noise = random.uniform() - 0.5;
            if n < burst { noise * (PI * (n as f32 + 0.5) / burst as f32).sin().powi(2) } else { 0.0 }
        } else {
            let share = CLICKS[event / 2 % CLICKS.len()];
            0.5 * (-fall * n as f32).exp() * (TAU * share * n as f32).sin()
        }
    };
    (0..samples(seconds)).map(|i| at(i, &mut random)).collect()
}

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

    #[test]
    fn the_sound_has_all_its_seconds_and_pauses() {
        let x = bursts_and_clicks(8000.0, 2.0);
        assert_eq!(x.len(), 16_000);
        assert!(x.iter().all(|v| v.abs() <= 0.5));
        let level = |from: usize, to: usize| x[from..to].iter().map(|v| v * v).sum::<f32>();
        assert!(level(0, 480) > 0.1 && level(480, 1000) == 0.0 && level(1000, 1200) > 0.1);
    }
}
