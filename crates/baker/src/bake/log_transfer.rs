//! Transfer functions as they are interpolated between measurements.

use crate::bake::direct::{Direct, set_ears};
use crate::bake::model::Modelled;
use promenade_core::{StftGrid, TransferFunction, TransferShape};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{NO_GAIN, floored_log, minimum_phase, signal, spectrum};
use std::f64::consts::TAU;

/// An ear's direct sound begins so long before its onset, seconds: from the first of these on it rises, from the second on it
/// is whole. Phases between those of two measurements ring before it.
const RISES_S: [f64; 2] = [0.00125, 0.00075];
/// From the first of these on, after the arrival at the head's centre, it fades, at the second it has ended.
const ENDS_S: [f64; 2] = [0.0035, 0.005];
/// Share of an ear's peak at its onset.
const ONSET: f64 = 0.1;

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
    /// and adds the model of the node's. Phases are those of a sum of phasors: a zero that leaves the unit circle from
    /// one measurement to the next turns all phases above its notch by a whole turn, and half a turn is not between them.
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
        let excess = |ear: usize| -> Vec<f64> {
            let sum = |k: usize| -> Complex64 {
                weights.iter().map(|&(i, w)| Complex64::from_polar(w, measured[i].excess[ear][k])).sum()
            };
            (0..node.logs[ear].len()).map(|k| sum(k).arg()).collect()
        };
        let off_trend: f64 = weights.iter().map(|&(i, w)| w * (measured[i].delay_s - trend * models[i].delay_s)).sum();
        Self { direct: [direct(0), direct(1)], excess: [excess(0), excess(1)], delay_s: off_trend + trend * node.delay_s }
    }

    /// The transfer function on a grid, without time filters.
    pub(crate) fn to_transfer(&self, shape: &TransferShape, grid: &StftGrid) -> TransferFunction {
        let mut out = shape.silent();
        let ears = [-1.0, 1.0].into_iter().zip(self.direct.iter().zip(&self.excess)).map(|(side, (logs, excess))| {
            let gains: Vec<f64> = logs.iter().map(|log| linear(*log)).collect();
            let minimum = minimum_phase(floored_log(&gains), grid.n_fft);
            let phases: Vec<f64> = minimum.zip(excess).map(|(minimum, excess)| f64::from(minimum) + excess).collect();
            in_time(&gains, &phases, 0.5 * side * self.delay_s, grid)
        });
        let ears: Vec<(Vec<f64>, Vec<f64>)> = ears.collect();
        for (k, (left, right)) in ears[0].0.iter().zip(&ears[1].0).enumerate() {
            set_ears(&mut out, k, [*left, *right]);
        }
        out.phase = ears.iter().flat_map(|(_, phases)| phases.iter().map(|phase| *phase as f32)).collect();
        out.delay_s = self.delay_s as f32;
        out
    }
}

/// Gains and phases of an ear, whose sound is earlier by `early_s`, without what rings before its onset and after its end.
fn in_time(gains: &[f64], phases: &[f64], early_s: f64, grid: &StftGrid) -> (Vec<f64>, Vec<f64>) {
    let bin = |(k, (gain, phase)): (usize, (&f64, &f64))| Complex64::from_polar(*gain, phase + TAU * grid.bin_hz(k) * early_s);
    let whole: Vec<Complex64> = gains.iter().zip(phases).enumerate().map(bin).collect();
    let mut samples: Vec<f64> = signal(whole.clone(), grid.n_fft);
    // What comes before the arrival lies at the frame's end.
    let before = grid.n_fft as i64 / 4;
    let time = |i: usize| (i as i64 + before) % grid.n_fft as i64 - before;
    let peak = samples.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
    let sounding = (0..samples.len()).filter(|i| samples[*i].abs() > ONSET * peak);
    let Some(onset) = sounding.map(time).min() else { return (gains.to_vec(), phases.to_vec()) };
    let onset_s = onset as f64 / grid.sample_rate_hz;
    let ramp = |from: f64, to: f64, at: f64| 0.5 - 0.5 * (0.5 * TAU * ((at - from) / (to - from)).clamp(0.0, 1.0)).cos();
    for (i, sample) in samples.iter_mut().enumerate() {
        let at_s = time(i) as f64 / grid.sample_rate_hz;
        let rises = ramp(onset_s - RISES_S[0], onset_s - RISES_S[1], at_s);
        *sample *= rises * (1.0 - ramp(ENDS_S[0], ENDS_S[1], at_s));
    }
    let found = spectrum(samples, grid.n_fft);
    // Near the phases that were there, so that they are unwrapped as those were.
    let turned = found.iter().zip(&whole).map(|(x, before)| (x * before.conj()).arg());
    (found.iter().map(|x| x.norm()).collect(), phases.iter().zip(turned).map(|(phase, turned)| phase + turned).collect())
}

/// The gain with a log; silence for what counts as that.
fn linear(log: f64) -> f64 {
    if log <= NO_GAIN.ln() + 0.1 { 0.0 } else { log.exp() }
}

/// Size of the measured head over the model's, by its delays: least squares.
pub(crate) fn delay_trend(models: &[Modelled], measured: &[LogTransfer]) -> f64 {
    let pairs = || models.iter().map(|m| m.delay_s).zip(measured.iter().map(|r| r.delay_s));
    let square: f64 = pairs().map(|(x, _)| x * x).sum();
    // A tenth of a millisecond at one measurement says what the size is.
    if square > 1e-8 { pairs().map(|(x, d)| x * d).sum::<f64>() / square } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::spectrum::Analyser;

    #[test]
    fn a_zero_across_the_unit_circle_leaves_the_phases_between_two_measurements() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let analyser = Analyser::new(grid);
        let (notch, radius) = (100, 0.97_f32);
        // The same magnitude with the zeros inside the unit circle and outside.
        let inside = [1.0, -2.0 * radius * (TAU as f32 * notch as f32 / 320.0).cos(), radius * radius];
        let outside = [inside[2], inside[1], inside[0]];
        let heard = |zeros: [f32; 3]| {
            let mut ear = vec![0.0; 400];
            ear[100..103].copy_from_slice(&zeros);
            LogTransfer::of(&Direct::of([&ear, &ear], None, &grid, &analyser).unwrap(), 1.0, 1.0)
        };
        let model = || Modelled { logs: [vec![0.0; grid.bins()], vec![0.0; grid.bins()]], delay_s: 0.0 };
        let measured = [heard(inside), heard(outside)];
        let models = [model(), model()];
        let phases = |shares: [f64; 2]| {
            let weights = [(0, shares[0]), (1, shares[1])];
            let blend = LogTransfer::blend(&measured, &models, &weights, 1.0, &model());
            blend.to_transfer(&TransferShape { bins: grid.bins(), bands: 1, taps: 0 }, &grid).phase
        };
        let (first, second, between) = (phases([1.0, 0.0]), phases([0.0, 1.0]), phases([0.5, 0.5]));
        let near = |a: f32, b: f32| Complex64::cis(f64::from(a - b)).re;
        for k in (10..notch - 20).chain(notch + 20..grid.bins() - 10) {
            let ends = 0.5 * (Complex64::cis(f64::from(first[k])) + Complex64::cis(f64::from(second[k])));
            assert!(ends.norm() > 0.9 && near(between[k], ends.arg() as f32) > 0.98, "{k}: {ends} {}", between[k]);
        }
    }

    #[test]
    fn what_rings_before_the_onset_is_taken_off_and_the_rest_stays() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let mut samples = vec![0.0; grid.n_fft];
        // A sound at the arrival, a ring 2 ms before it and one long after.
        (samples[0], samples[2], samples[grid.n_fft - 32], samples[100]) = (1.0, 0.5, 0.05, 0.05);
        let wanted = spectrum(samples.iter().enumerate().map(|(i, v)| if i < 10 { *v } else { 0.0 }), grid.n_fft);
        let whole = spectrum(samples.iter().copied(), grid.n_fft);
        let early_s = 0.25e-3;
        let gains: Vec<f64> = whole.iter().map(|x| x.norm()).collect();
        let late = |k: usize| TAU * grid.bin_hz(k) * early_s;
        let phases: Vec<f64> = whole.iter().enumerate().map(|(k, x)| x.arg() + TAU * 3.0 - late(k)).collect();
        let (found, turned) = in_time(&gains, &phases, early_s, &grid);
        // The ends of the spectrum are real.
        for k in 1..grid.bins() - 1 {
            let x = Complex64::from_polar(found[k], turned[k] + late(k));
            assert!((x - wanted[k]).norm() < 1e-6, "{k}: {x} {}", wanted[k]);
            assert!((turned[k] - phases[k]).abs() < 0.5 * TAU);
        }
    }
}
