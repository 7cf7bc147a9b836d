//! From what was recorded in the cells to responses.

use crate::low_frequency::low_field::{FADE, response};
use promenade_fourier::forward;
use promenade_fourier::num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Where the pulse has most, as a share of the highest frequency that is asked for.
const PULSE: f64 = 0.6;
/// Middle of the pulse, periods of that frequency.
const PULSE_MIDDLE: f64 = 1.6;
/// Samples a second, times the highest frequency.
const RECORDED: f64 = 3.8;
/// How much finer spectra are than their sound needs.
const FINE: usize = 8;

/// What the source sends: a bell's second derivative, so that nothing is left of it in the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulse {
    most_hz: f64,
    dt_s: f64,
}

impl Pulse {
    pub(super) fn new(top_hz: f64, dt_s: f64) -> Self {
        Self { most_hz: PULSE * FADE * top_hz, dt_s }
    }

    pub(super) fn at(&self, step: usize) -> f64 {
        let place = PI * (self.most_hz * step as f64 * self.dt_s - PULSE_MIDDLE);
        (1.0 - 2.0 * place * place) * (-place * place).exp()
    }

    /// Steps until it is over.
    pub(super) fn steps(&self) -> usize {
        (2.0 * PULSE_MIDDLE / (self.most_hz * self.dt_s)).ceil() as usize
    }

    /// Its spectrum at an angle per step, a sum over its samples.
    fn spectrum(&self, angle: f64) -> Complex64 {
        (0..self.steps()).map(|n| Complex64::cis(-angle * n as f64) * self.at(n)).sum()
    }
}

/// Signals that were recorded at every so many steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Recorder {
    pulse: Pulse,
    /// Steps from one sample to the next.
    pub(super) every: usize,
    top_hz: f64,
}

impl Recorder {
    pub(super) fn new(pulse: Pulse, top_hz: f64) -> Self {
        let every = (1.0 / (RECORDED * FADE * top_hz * pulse.dt_s)).floor().max(1.0) as usize;
        Self { pulse, every, top_hz }
    }

    /// The impulse response, `length` samples at `rate_hz`, of what was recorded. Time steps make tones of the room too low:
    /// what sounds at `f` is found at `asin(pi f dt) / (pi dt)`.
    pub(super) fn response(&self, recorded: &[f32], length: usize, rate_hz: f64) -> Vec<f32> {
        let (dt, step) = (self.pulse.dt_s, self.pulse.dt_s * self.every as f64);
        let n = (FINE * recorded.len()).next_power_of_two();
        let plan = forward(n);
        let mut padded = plan.make_input_vec();
        padded[..recorded.len()].copy_from_slice(recorded);
        let mut bins = plan.make_output_vec();
        let done = plan.process(&mut padded, &mut bins);
        debug_assert!(done.is_ok());
        // Turned about a middle of the sound, spectra are smooth between bins.
        let middle = 0.25 * recorded.len() as f64;
        let bin = |k: usize| {
            let value = bins[k.min(n / 2)];
            Complex64::new(f64::from(value.re), f64::from(value.im)) * Complex64::cis(TAU * k as f64 * middle / n as f64)
        };
        let at = |angle: f64| -> Complex64 {
            let place = angle * self.every as f64 / TAU * n as f64;
            let below = (place.floor() as usize).max(1);
            let t = place - below as f64;
            let [a, b, c, d] = [below - 1, below, below + 1, below + 2].map(bin);
            let weights = [
                -t * (t - 1.0) * (t - 2.0) / 6.0,
                (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
                -(t + 1.0) * t * (t - 2.0) / 2.0,
                (t + 1.0) * t * (t - 1.0) / 6.0,
            ];
            let sum = a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3];
            sum * Complex64::cis(-angle * self.every as f64 * middle)
        };
        response(length, rate_hz, self.top_hz, |hz| {
            let angle = 2.0 * (PI * hz * dt).asin();
            at(angle) * (step / dt) / self.pulse.spectrum(angle)
        })
    }
}
