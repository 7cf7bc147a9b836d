//! The field of a room at low frequencies, as a response at a low rate for each place.

use glam::DVec3;
use promenade_fourier::inverse;
use promenade_fourier::num_complex::{Complex32, Complex64};
use std::f64::consts::{PI, TAU};

/// Responses are silent below the first of these, Hz, and whole from the second on.
pub(crate) const LOWEST_HZ: (f64, f64) = (10.0, 18.0);
/// They end at this many times the frequency up to which they are whole.
pub(crate) const FADE: f64 = 1.2;
/// Samples a second, times that frequency.
pub(crate) const RATE: f64 = 2.5;

/// A source is no nearer than this, metres.
const NEAREST_M: f64 = 0.25;

/// What an omnidirectional source makes that sends an impulse: 1/r in free space, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LowField {
    /// Samples a second.
    pub rate_hz: f64,
    /// Responses are whole up to here, Hz, and end a fifth above.
    pub top_hz: f64,
    /// One of each place.
    pub places: Vec<LowResponse>,
}

/// What is heard at one place; sample 0 is when the source sounds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LowResponse {
    /// Pressure, 1 at a metre in free space for as much at every frequency.
    pub pressure: Vec<f32>,
    /// Its gradient along x, y and z, per metre.
    pub gradient: [Vec<f32>; 3],
}

impl LowField {
    /// Adds what places would hear of the source in free space, times a gain: -1 takes it off.
    pub fn add_direct(&mut self, gain: f32, source: [f64; 3], places: &[[f64; 3]], speed_m_s: f64) {
        for (own, place) in self.places.iter_mut().zip(places) {
            let away = DVec3::from(*place) - DVec3::from(source);
            let distance = away.length().max(NEAREST_M);
            let number = |hz: f64| Complex64::new(0.0, TAU * hz / speed_m_s);
            // The wave at each frequency of the transform, from that of the one before.
            let n = transform_len(own.pressure.len());
            let step = (-number(self.rate_hz / n as f64) * distance).exp();
            let waves: Vec<Complex64> =
                std::iter::successors(Some(Complex64::from(distance.recip())), |wave| Some(wave * step))
                    .take(n / 2 + 1)
                    .collect();
            let wave = |hz: f64| waves[((hz * n as f64 / self.rate_hz).round() as usize).min(n / 2)];
            let free = |of: &dyn Fn(f64) -> Complex64| response(own.pressure.len(), self.rate_hz, self.top_hz, of);
            let pressure = free(&wave);
            let slope = free(&|hz| -wave(hz) * (number(hz) + 1.0 / distance) / distance);
            own.pressure.iter_mut().zip(&pressure).for_each(|(h, f)| *h += gain * f);
            for (gradient, along) in own.gradient.iter_mut().zip(away.to_array()) {
                gradient.iter_mut().zip(&slope).for_each(|(h, f)| *h += gain * along as f32 * f);
            }
        }
    }
}

/// How much of a frequency responses have.
pub(crate) fn share(hz: f64, top_hz: f64) -> f64 {
    let rise = |from: f64, to: f64| {
        let place = ((hz - from) / (to - from)).clamp(0.0, 1.0);
        0.5 - 0.5 * (PI * place).cos()
    };
    rise(LOWEST_HZ.0, LOWEST_HZ.1) * (1.0 - rise(top_hz, FADE * top_hz))
}

/// A response of `length` samples from its spectrum, which is asked for at the frequencies of a transform that is longer by a
/// quarter, Hz; what lies after the end is faded out.
pub(crate) fn response(length: usize, rate_hz: f64, top_hz: f64, spectrum: impl Fn(f64) -> Complex64) -> Vec<f32> {
    let n = transform_len(length);
    let plan = inverse(n);
    let mut bins = plan.make_input_vec();
    let mut out = plan.make_output_vec();
    for (k, bin) in bins.iter_mut().enumerate() {
        let hz = k as f64 * rate_hz / n as f64;
        let share = share(hz, top_hz);
        if share > 0.0 && 2 * k < n {
            let value = spectrum(hz) * (share / n as f64);
            *bin = Complex32::new(value.re as f32, value.im as f32);
        }
    }
    let done = plan.process(&mut bins, &mut out);
    debug_assert!(done.is_ok());
    out.truncate(length);
    out
}

/// Samples of the transform that responses of this length come from.
pub(crate) fn transform_len(length: usize) -> usize {
    (length + length / 4 + 64).next_multiple_of(2)
}
