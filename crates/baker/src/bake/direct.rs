//! The direct sound of a measured response: arrival, masks, phase, interaural delay.

use crate::signal::spectrum::{Analyser, at};
use promenade_core::{StftGrid, TransferFunction};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{floored_log, minimum_phase};
use promenade_metrics::onset;
use std::f64::consts::TAU;

/// The direct sound begins this long before the earlier onset, seconds.
const LEAD_S: f64 = 0.001;
/// It is whole up to this long after the arrival at the head, seconds ...
pub(crate) const WHOLE_S: f64 = 0.002;
/// ... and has faded out by here, before early reflections take over.
const END_S: f64 = 0.0035;
/// The longest delay of an ear against the estimated arrival, seconds, and how finely it is searched.
const LONGEST_DELAY_S: f64 = 0.0012;
const DELAY_STEP_S: f64 = 4e-6;

/// Direct sound at both ears.
#[derive(Clone, Debug)]
pub(crate) struct Direct {
    /// Sample of the response at which sound reaches the head's centre: midway between the ears' delays.
    pub(crate) arrival: i64,
    /// Magnitude per bin, left and right, at the measured distance.
    pub(crate) gain: [Vec<f64>; 2],
    /// Phase per bin beyond that of the minimum-phase filter and the interaural delay, left and right, radians.
    pub(crate) excess: [Vec<f64>; 2],
    /// Interaural delay, seconds, positive when the left ear is later.
    pub(crate) delay_s: f64,
    /// The response without the direct sound, left and right.
    pub(crate) rest: [Vec<f32>; 2],
}

impl Direct {
    /// Cuts the direct sound out of a response that arrives at a sample, where that is known. `None` if an ear is silent.
    ///
    /// The delay of the ear that hears it first is the lag at which it correlates best with the minimum-phase filter of its
    /// magnitude, the interaural one that at which the ears do, both without minimum phase (Kulkarni, Isabelle and Colburn
    /// 1999): what a loudspeaker does to phases is the same at both. What phase is left is kept, so that nothing of the
    /// measurement is lost.
    pub(crate) fn of(ears: [&[f32]; 2], arrival: Option<i64>, grid: &StftGrid, analyser: &Analyser) -> Option<Self> {
        let onsets = [onset(ears[0])? as i64, onset(ears[1])? as i64];
        let start = onsets[0].min(onsets[1]) - samples(grid, LEAD_S);
        let guess = Window { start, arrival: (onsets[0] + onsets[1]) / 2 };
        let [left, right] = ears.map(|ear| Ear::of(ear, &guess, grid, analyser).against_minimum);
        let cross: Vec<Complex64> = left.iter().zip(&right).map(|(l, r)| l * r.conj()).collect();
        let delay_s = delay_s(cross.iter().map(|x| x.unscale(x.norm().sqrt().max(f64::MIN_POSITIVE))), grid);
        let centre_s = if onsets[0] <= onsets[1] {
            self::delay_s(left.into_iter(), grid) - 0.5 * delay_s
        } else {
            self::delay_s(right.into_iter(), grid) + 0.5 * delay_s
        };
        let arrival = arrival.unwrap_or_else(|| guess.arrival + (centre_s * grid.sample_rate_hz).round() as i64);
        let window = Window { arrival, ..guess };
        let [left, right] = ears.map(|ear| Ear::of(ear, &window, grid, analyser));
        let excess = [left.excess(0.5 * delay_s, grid), right.excess(-0.5 * delay_s, grid)];
        let rest = ears.map(|ear| {
            ear.iter().enumerate().map(|(i, v)| (1.0 - window.share(grid, i as i64)) as f32 * v).collect::<Vec<f32>>()
        });
        Some(Self { arrival: window.arrival, gain: [left.gain, right.gain], excess, delay_s, rest })
    }
}

fn samples(grid: &StftGrid, seconds: f64) -> i64 {
    (seconds * grid.sample_rate_hz).round() as i64
}

/// Where the direct sound lies in a response.
struct Window {
    start: i64,
    arrival: i64,
}

impl Window {
    /// Share of a sample that belongs to the direct sound.
    fn share(&self, grid: &StftGrid, sample: i64) -> f64 {
        let (whole, end) = (self.arrival + samples(grid, WHOLE_S), self.arrival + samples(grid, END_S));
        match sample {
            i if i < self.start => 0.0,
            i if i < whole => 1.0,
            i if i >= end => 0.0,
            i => 0.5 + 0.5 * (std::f64::consts::PI * (i - whole) as f64 / (end - whole) as f64).cos(),
        }
    }
}

/// The direct sound of one ear.
struct Ear {
    gain: Vec<f64>,
    /// Direct sound over the minimum-phase filter of its magnitude, per bin, times the magnitude squared.
    against_minimum: Vec<Complex64>,
}

impl Ear {
    fn of(response: &[f32], window: &Window, grid: &StftGrid, analyser: &Analyser) -> Self {
        let (n, end) = (grid.n_fft as i64, window.arrival + samples(grid, END_S));
        let mut piece = vec![0.0; grid.n_fft];
        for i in window.start.max(end - n)..end {
            // The arrival is time 0; what comes before it lies at the frame's end.
            piece[(i - window.arrival).rem_euclid(n) as usize] = window.share(grid, i) * at(response, i);
        }
        let spectrum = analyser.spectrum(&piece);
        let gain: Vec<f64> = spectrum.iter().map(|x| x.norm()).collect();
        let minimum = minimum_phase(floored_log(&gain), grid.n_fft);
        let against = spectrum.iter().zip(minimum).map(|(x, phase)| x * Complex64::from_polar(x.norm(), -f64::from(phase)));
        Self { against_minimum: against.collect(), gain }
    }

    /// Phase beyond minimum phase and a delay, radians.
    fn excess(&self, delay_s: f64, grid: &StftGrid) -> Vec<f64> {
        let late = |k: usize| Complex64::from_polar(1.0, TAU * grid.bin_hz(k) * delay_s);
        self.against_minimum.iter().enumerate().map(|(k, x)| (x * late(k)).arg()).collect()
    }
}

/// The delay at which the bins of a spectrum are most alike in phase, seconds.
fn delay_s(bins: impl Iterator<Item = Complex64> + Clone, grid: &StftGrid) -> f64 {
    let steps = (LONGEST_DELAY_S / DELAY_STEP_S) as i32;
    let likeness = |delay_s: f64| -> f64 {
        let step = Complex64::from_polar(1.0, TAU * grid.bin_hz(1) * delay_s);
        let turned = bins.clone().scan(Complex64::from(1.0), |turn, x| {
            let term = (x * *turn).re;
            *turn *= step;
            Some(term)
        });
        turned.sum()
    };
    let delays = (-steps..=steps).map(|i| f64::from(i) * DELAY_STEP_S);
    delays.map(|d| (d, likeness(d))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |best| best.0)
}

/// Sets the masks of a bin from the gains of both ears.
pub(crate) fn set_ears(transfer: &mut TransferFunction, bin: usize, [left, right]: [f64; 2]) {
    let sum = left + right;
    transfer.mixture[bin] = (0.5 * sum) as f32;
    transfer.difference[bin] = if sum > 0.0 { ((right - left) / sum) as f32 } else { 0.0 };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delay_of_a_shadowed_ear_is_found_through_a_loudspeaker() {
        let grid = StftGrid { sample_rate_hz: 16_000.0, n_fft: 320, hop: 80 };
        let analyser = Analyser::new(grid);
        // A loudspeaker that plays low sounds later: three all-passes in a row.
        let mut near = vec![0.0_f32; 600];
        near[200] = 1.0;
        for _ in 0..3 {
            let (pole, mut last) = (0.5, (0.0, 0.0));
            for x in &mut near {
                let y = -pole * *x + last.0 + pole * last.1;
                last = (*x, y);
                *x = y;
            }
        }
        // The far ear is ten samples later, behind two low passes of minimum phase.
        let mut far = [vec![0.0; 10], near.clone()].concat();
        for _ in 0..2 {
            let mut last = 0.0;
            for x in &mut far {
                last = 0.2 * *x + 0.8 * last;
                *x = last;
            }
        }
        let direct = Direct::of([&far, &near], None, &grid, &analyser).unwrap();
        assert!((direct.delay_s - 10.0 / grid.sample_rate_hz).abs() < 4e-5, "{}", direct.delay_s);
        let other = Direct::of([&near, &far], None, &grid, &analyser).unwrap();
        assert!((other.delay_s + direct.delay_s).abs() < 1e-6 && other.arrival == direct.arrival);
    }
}
