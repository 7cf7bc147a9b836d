//! Heads that tests hear with.

use super::Hrtf;
use crate::{Response, Responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use std::f32::consts::PI;

pub(crate) const RATE: u32 = 24_000;

pub(super) fn set(directions: &[Vec3], ears: impl Fn(Vec3) -> [Vec<f32>; 2]) -> Responses {
    let response = |(i, d): (usize, &Vec3)| {
        let [left, right] = ears(*d);
        Response { listener: Pose::IDENTITY, source: 1.4 * *d, left, right, name: format!("{i}") }
    };
    Responses {
        sample_rate_hz: f64::from(RATE),
        responses: directions.iter().enumerate().map(response).collect(),
        ..Responses::default()
    }
}

/// A head that hears alike from everywhere: two ears at its centre.
pub(crate) fn transparent() -> Hrtf {
    let pulse = || (0..64).map(|i| f32::from(u8::from(i == 20))).collect();
    Hrtf::new(&set(&[Vec3::X], |_| [pulse(), pulse()]), RATE).unwrap()
}

/// Ears that hear their own side earlier, by up to 16 samples, and louder; the same to the left and to the right.
pub(crate) fn two_sided() -> Hrtf {
    let half = (0..200).map(|i| {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / 200.0;
        let turn = 2.4 * i as f32;
        Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
    });
    let directions: Vec<Vec3> = half.flat_map(|d| [d, Vec3::new(d.x, -d.y, d.z)]).collect();
    let ear = |side: f32| -> Vec<f32> {
        let pulse = |i: i32| {
            let t = i as f32 - (30.0 - 8.0 * side);
            let sinc = if t.abs() < 1e-4 { 1.0 } else { (PI * t).sin() / (PI * t) };
            (1.0 + 0.6 * side) * sinc * (0.5 + 0.5 * (PI * t / 17.0).cos()) * f32::from(u8::from(t.abs() < 17.0))
        };
        (0..64).map(pulse).collect()
    };
    Hrtf::new(&set(&directions, |d| [ear(d.y), ear(-d.y)]), RATE).unwrap()
}
