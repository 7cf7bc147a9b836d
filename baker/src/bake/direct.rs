//! The direct sound of a measured response: arrival, masks, common phase.

use crate::signal::spectrum::{Analyser, at};
use promenade_core::{StftGrid, TransferFunction};
use promenade_metrics::onset;

/// The direct sound begins this long before the earlier onset, seconds.
const LEAD_S: f64 = 0.001;
/// It is whole up to this long after the arrival at the head, seconds ...
const WHOLE_S: f64 = 0.002;
/// ... and has faded out by here, before early reflections take over.
const END_S: f64 = 0.0035;

/// Direct sound at both ears.
#[derive(Clone, Debug)]
pub(crate) struct Direct {
    /// Sample of the response at which sound reaches the head's centre: midway between the ears' onsets.
    pub(crate) arrival: i64,
    /// Magnitude per bin, left and right, at the measured distance.
    pub(crate) gain: [Vec<f64>; 2],
    /// The response without the direct sound, left and right.
    pub(crate) rest: [Vec<f32>; 2],
}

impl Direct {
    /// Cuts the direct sound out of a response. `None` if an ear is silent.
    pub(crate) fn of(ears: [&[f32]; 2], grid: &StftGrid, analyser: &Analyser) -> Option<Self> {
        let onsets = [onset(ears[0])? as i64, onset(ears[1])? as i64];
        let arrival = (onsets[0] + onsets[1]) / 2;
        let samples = |s: f64| (s * grid.sample_rate_hz).round() as i64;
        let start = onsets[0].min(onsets[1]) - samples(LEAD_S);
        let (whole, end) = (arrival + samples(WHOLE_S), arrival + samples(END_S));
        let share = |i: i64| match i {
            i if i < whole => 1.0,
            i if i >= end => 0.0,
            i => 0.5 + 0.5 * (std::f64::consts::PI * (i - whole) as f64 / (end - whole) as f64).cos(),
        };
        let gain = ears.map(|ear| {
            let piece: Vec<f64> = (start..end).map(|i| share(i) * at(ear, i)).collect();
            analyser.spectrum(&piece).iter().map(|x| x.norm()).collect()
        });
        let rest = ears.map(|ear| ear.iter().enumerate().map(|(i, v)| (1.0 - share(i as i64) as f32) * v).collect());
        Some(Self { arrival, gain, rest })
    }
}

/// Sets the masks of a bin from the gains of both ears.
pub(crate) fn set_ears(transfer: &mut TransferFunction, bin: usize, [left, right]: [f64; 2]) {
    let sum = left + right;
    transfer.mixture[bin] = (0.5 * sum) as f32;
    transfer.difference[bin] = if sum > 0.0 { ((right - left) / sum) as f32 } else { 0.0 };
}
