//! Transfer functions as they are interpolated between measurements.

use crate::bake::direct::{Direct, phase_start, set_ears};
use crate::bake::kriging::Site;
use crate::bake::model::Modelled;
use promenade_core::{StftGrid, TransferFunction, TransferShape};
use promenade_fourier::{NO_GAIN, floored_log, minimum_phase};
use std::f64::consts::TAU;

/// What is interpolated of a measurement: log gains of the direct sound at a distance of 1 m, its phase and delay.
///
/// Gains of measurements a few degrees apart differ by factors, and delays by sums; complex spectra that differ in delay would
/// cancel.
#[derive(Clone, Debug)]
pub(crate) struct LogTransfer {
    direct: [Vec<f64>; 2],
    /// Phase beyond minimum phase and delay, radians.
    excess: [Vec<f64>; 2],
    delay_s: f64,
}

impl LogTransfer {
    /// Takes a direct sound times `gain`, measured at a distance.
    pub(crate) fn of(direct: &Direct, gain: f64, distance_m: f64) -> Self {
        let log = |g: f64| g.max(NO_GAIN).ln();
        Self {
            direct: direct.gain.each_ref().map(|ear| ear.iter().map(|g| log(gain * distance_m * g)).collect()),
            excess: direct.excess.clone(),
            delay_s: direct.delay_s,
        }
    }

    /// Interpolates what measurements are beyond a model of their directions, `models`, whose delays are `trend` times as long,
    /// and adds the model of the node's.
    pub(crate) fn blend<'a>(
        measured: &'a [Self],
        models: &'a [Modelled],
        weights: &[(usize, f64)],
        trend: f64,
        node: &Modelled,
    ) -> Self {
        let sum = |pick: &dyn Fn(usize) -> &'a Vec<f64>| {
            let mut out = vec![0.0; pick(0).len()];
            for &(i, w) in weights {
                out.iter_mut().zip(pick(i)).for_each(|(o, v)| *o += w * v);
            }
            out
        };
        let direct = |ear: usize| -> Vec<f64> {
            let (own, model) = (sum(&|i| &measured[i].direct[ear]), sum(&|i| &models[i].logs[ear]));
            own.iter().zip(model).zip(&node.logs[ear]).map(|((own, model), node)| own - model + node).collect()
        };
        let off_trend: f64 = weights.iter().map(|&(i, w)| w * (measured[i].delay_s - trend * models[i].delay_s)).sum();
        Self {
            direct: [direct(0), direct(1)],
            excess: [sum(&|i| &measured[i].excess[0]), sum(&|i| &measured[i].excess[1])],
            delay_s: off_trend + trend * node.delay_s,
        }
    }

    /// The transfer function on a grid, without time filters.
    pub(crate) fn to_transfer(&self, shape: &TransferShape, grid: &StftGrid) -> TransferFunction {
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

/// Size of the measured head over the model's, by its delays: least squares.
pub(crate) fn delay_trend(models: &[Modelled], measured: &[LogTransfer]) -> f64 {
    let pairs = || models.iter().map(|m| m.delay_s).zip(measured.iter().map(|r| r.delay_s));
    let square: f64 = pairs().map(|(x, _)| x * x).sum();
    // A tenth of a millisecond at one measurement says what the size is.
    if square > 1e-8 { pairs().map(|(x, d)| x * d).sum::<f64>() / square } else { 1.0 }
}
