//! Transfer functions as they are interpolated between measurements.

use crate::bake::direct::{Direct, phase_start, set_ears};
use crate::bake::kriging::Site;
use promenade_core::{StftGrid, TransferFunction, TransferShape};
use promenade_fourier::{NO_GAIN, floored_log, minimum_phase};
use std::f64::consts::TAU;

/// What is interpolated of a measurement: log gains of the direct sound at a distance of 1 m, its phase and delay, and log
/// gains of the late part.
///
/// Gains of measurements a few degrees apart differ by factors, and delays by sums; complex spectra that differ in delay would
/// cancel.
#[derive(Clone, Debug)]
pub(crate) struct LogTransfer {
    direct: [Vec<f64>; 2],
    /// Phase beyond minimum phase and delay, radians.
    excess: [Vec<f64>; 2],
    delay_s: f64,
    late: Vec<f64>,
}

impl LogTransfer {
    /// Takes a direct sound and gains of the late part, `[ear][band]`, both times `gain`, measured at a distance.
    pub(crate) fn of(direct: &Direct, late: &[f64], gain: f64, distance_m: f64) -> Self {
        let log = |g: f64| g.max(NO_GAIN).ln();
        Self {
            direct: direct.gain.each_ref().map(|ear| ear.iter().map(|g| log(gain * distance_m * g)).collect()),
            excess: direct.excess.clone(),
            delay_s: direct.delay_s,
            late: late.iter().map(|g| log(gain * g)).collect(),
        }
    }

    pub(crate) fn blend(measured: &[Self], sites: &[Site], weights: &[(usize, f64)], trend: f64, node: &Site) -> Self {
        let sum = |pick: &dyn Fn(&Self) -> &Vec<f64>| {
            let mut out = vec![0.0; pick(&measured[0]).len()];
            for &(i, w) in weights {
                out.iter_mut().zip(pick(&measured[i])).for_each(|(o, v)| *o += w * v);
            }
            out
        };
        let off_trend: f64 = weights.iter().map(|&(i, w)| w * (measured[i].delay_s - trend * lateral(&sites[i]))).sum();
        Self {
            direct: [sum(&|r| &r.direct[0]), sum(&|r| &r.direct[1])],
            excess: [sum(&|r| &r.excess[0]), sum(&|r| &r.excess[1])],
            delay_s: off_trend + trend * lateral(node),
            late: sum(&|r| &r.late),
        }
    }

    /// Gains of the late part, linear amplitude, `[ear][band]`.
    pub(crate) fn late(&self) -> Vec<f64> {
        self.late.iter().map(|log| linear(*log)).collect()
    }

    /// The transfer function on a grid, with `taps` for its time filters.
    pub(crate) fn to_transfer(&self, shape: &TransferShape, grid: &StftGrid, taps: Vec<f32>) -> TransferFunction {
        let mut out = shape.silent();
        let gains = self.direct.each_ref().map(|ear| ear.iter().map(|log| linear(*log)).collect::<Vec<f64>>());
        for (k, (left, right)) in gains[0].iter().zip(&gains[1]).enumerate() {
            set_ears(&mut out, k, [*left, *right]);
        }
        let phases = gains.iter().zip(&self.excess).flat_map(|(gain, excess)| {
            minimum_phase(floored_log(gain), grid.n_fft).zip(excess).map(|(minimum, excess)| minimum + *excess as f32)
        });
        out.phase = phases.collect();
        out.delay_s = self.delay_s as f32;
        out.taps = taps;
        out.late = self.late().iter().map(|g| *g as f32).collect();
        out
    }
}

/// The gain with a log; silence for what counts as that.
fn linear(log: f64) -> f64 {
    if log <= NO_GAIN.ln() + 0.1 { 0.0 } else { log.exp() }
}

/// Adds whole turns to the phases of measurements until neighbours differ by less than half a turn where phases are unwrapped
/// from: only then is there a phase between them. From the first measurement on, each is brought near to its nearest one that
/// has been before.
pub(crate) fn align_phases(measured: &mut [LogTransfer], sites: &[Site], grid: &StftGrid) {
    let start = phase_start(grid);
    let mut left: Vec<usize> = (1..measured.len()).collect();
    // The nearest aligned measurement of each that is left, and its distance.
    let mut nearest: Vec<(usize, f64)> = sites.iter().map(|s| (0, s.distance(&sites[0]))).collect();
    while let Some(at) = (0..left.len()).min_by(|&a, &b| nearest[left[a]].1.total_cmp(&nearest[left[b]].1)) {
        let next = left.swap_remove(at);
        let parent = measured[nearest[next].0].excess.clone();
        for (phases, parent) in measured[next].excess.iter_mut().zip(&parent) {
            let turns = TAU * ((parent[start] - phases[start]) / TAU).round();
            phases.iter_mut().for_each(|p| *p += turns);
        }
        for &other in &left {
            let distance = sites[other].distance(&sites[next]);
            if distance < nearest[other].1 {
                nearest[other] = (next, distance);
            }
        }
    }
}

/// How the interaural delay of a rigid sphere varies with the angle towards the left ear (Woodworth 1938): asin(y) + y for the
/// component y of the direction towards the left, so that the delay is negative on the left.
fn lateral(site: &Site) -> f64 {
    let y = f64::from(site.direction.y).clamp(-1.0, 1.0);
    y.asin() + y
}

/// Delay per unit of [`lateral`], seconds, by least squares: the measured head's radius over the speed of sound, negated.
pub(crate) fn delay_trend(sites: &[Site], measured: &[LogTransfer]) -> f64 {
    let pairs = || sites.iter().map(lateral).zip(measured.iter().map(|r| r.delay_s));
    let square: f64 = pairs().map(|(x, _)| x * x).sum();
    if square > 0.1 { pairs().map(|(x, d)| x * d).sum::<f64>() / square } else { -0.09 / 343.0 }
}
