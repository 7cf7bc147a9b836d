//! The direct sound and the early reflections of an Ambisonic response, each sample from its own direction.

use super::direction::{FirstOrder, mean};
use super::ears::Frame;
use crate::sources::simulation::Hrtf;
use promenade_core::glam::{Quat, Vec3};
use promenade_core::head::{harmonics, lattice};
use std::collections::BTreeMap;

/// How long the direction of the direct sound holds, seconds: 128 samples at 48 kHz, as in BinauralSDM.
const DIRECT_S: f64 = 128.0 / 48_000.0;
/// Time before the onset that belongs to the direct sound, seconds.
const BEFORE_S: f64 = 0.001;
/// Directions that early reflections are rounded to, some 4 degrees apart.
const DIRECTIONS: usize = 2500;

/// Sound with a direction.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arrivals {
    /// Where the direct sound comes from, unit length, in the axes of the microphone.
    pub(super) direct: Vec3,
    /// How much louder the dipoles are than the omnidirectional channel in the direct sound, dB.
    pub(super) dipoles_db: f64,
    /// Directions in the axes of the microphone, each with samples of the response: their numbers and values.
    parts: Vec<(Vec3, Vec<(usize, f32)>)>,
    /// The last sample and one more.
    end: usize,
}

impl Arrivals {
    /// Gives each sample of `early`, the omnidirectional channel as long as it is early, its direction by the first order in
    /// the order of AmbiX with unit gain in their own direction (SN3D). `None` for silence around the `onset`.
    pub(super) fn of(first: [&[f32]; 4], early: &[f32], onset: usize, sample_rate_hz: f64) -> Option<Self> {
        let samples = |s: f64| (s * sample_rate_hz).round() as usize;
        let first = FirstOrder::of(first, sample_rate_hz);
        let intensities = first.intensities();
        let settled = onset + samples(DIRECT_S);
        let whole = onset.saturating_sub(samples(BEFORE_S))..settled.min(intensities.len());
        let direct = mean(&intensities[whole.clone()])?;
        let directions: Vec<Vec3> = (0..DIRECTIONS).map(|i| lattice(i, DIRECTIONS)).collect();
        let nearest = |v: Vec3| (0..DIRECTIONS).max_by(|a, b| directions[*a].dot(v).total_cmp(&directions[*b].dot(v)));
        // The direct sound has its direction to itself, not rounded.
        let mut parts: BTreeMap<Option<usize>, Vec<(usize, f32)>> = BTreeMap::new();
        for (i, v) in early.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let part = if i < settled { None } else { intensities[i].try_normalize().and_then(nearest) };
            parts.entry(part).or_default().push((i, *v));
        }
        let parts = parts.into_iter().map(|(i, samples)| (i.map_or(direct, |i| directions[i]), samples)).collect();
        Some(Self { direct, dipoles_db: first.dipoles_db(whole), parts, end: early.len() })
    }

    /// Takes what the arrivals are out of channels of equal energy in a diffuse field (N3D): what is left came from elsewhere.
    pub(super) fn take_from(&self, order: usize, early: &mut [Vec<f32>]) {
        for (direction, samples) in &self.parts {
            for (channel, gain) in early.iter_mut().zip(harmonics(order, *direction)) {
                for (at, value) in samples {
                    channel[*at] -= gain * value;
                }
            }
        }
    }

    /// What both ears of a head hear that is turned by `head` from the axes of the microphone, one lead of the frame later.
    pub(super) fn heard(&self, hrtf: &Hrtf, head: Quat) -> [Vec<f32>; 2] {
        let frame = Frame::of(hrtf);
        let turn = head.inverse();
        let mut ears = [vec![0.0; self.end + frame.length], vec![0.0; self.end + frame.length]];
        for (direction, samples) in &self.parts {
            for (ear, impulse) in ears.iter_mut().zip(frame.heard(hrtf, turn * *direction)) {
                for (at, value) in samples {
                    ear[*at..].iter_mut().zip(&impulse).for_each(|(e, i)| *e += value * i);
                }
            }
        }
        ears
    }
}
