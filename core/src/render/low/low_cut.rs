//! A high-pass of second order (Butterworth) that takes the bass off a dry sound.
//!
//! A state-variable filter by trapezoidal integration, which stays stable and quiet while its corner moves (Zavalishin, "The
//! Art of VA Filter Design" (2012), ch. 4).

use crate::number::single;
use std::f64::consts::{PI, SQRT_2};

/// Time in which the corner moves by a factor of e, and in which the filter fades in or out, seconds.
const GLIDE_S: f64 = 0.02;
/// States below this have died away: what follows would be subnormal.
const DEAD: f64 = 1e-20;

/// A low cut for one stream.
pub(crate) struct LowCut {
    sample_rate_hz: f64,
    /// The corner, and the one that is glided to, Hz.
    corner_hz: f64,
    target_hz: f64,
    /// Share of the filtered sound, and the one that is faded to.
    share: f64,
    wanted_share: f64,
    /// Steps of a sample: of the share, and of the corner's logarithm as a share of what is left.
    step: f64,
    integrators: [f64; 2],
    coefficients: Coefficients,
}

#[derive(Clone, Copy, Default)]
struct Coefficients {
    g: f64,
    a: f64,
}

impl Coefficients {
    fn new(corner_hz: f64, sample_rate_hz: f64) -> Self {
        let g = (PI * (corner_hz / sample_rate_hz).min(0.45)).tan();
        Self { g, a: 1.0 / (1.0 + g * (g + SQRT_2)) }
    }
}

impl LowCut {
    pub(crate) fn new(sample_rate_hz: f64) -> Self {
        Self {
            sample_rate_hz,
            corner_hz: 0.0,
            target_hz: 0.0,
            share: 0.0,
            wanted_share: 0.0,
            step: 1.0 / (GLIDE_S * sample_rate_hz),
            integrators: [0.0; 2],
            coefficients: Coefficients::default(),
        }
    }

    /// Sets the corner that is glided to, Hz, or jumped to; 0 for none.
    pub(crate) fn aim(&mut self, corner_hz: f32, jump: bool) {
        self.wanted_share = if corner_hz > 0.0 { 1.0 } else { 0.0 };
        if corner_hz > 0.0 {
            self.target_hz = corner_hz.into();
            if self.share == 0.0 {
                self.integrators = [0.0; 2];
            }
            if jump || self.share == 0.0 {
                self.move_to(self.target_hz);
            }
        }
        if jump {
            self.share = self.wanted_share;
        }
    }

    /// Whether anything is taken off.
    pub(crate) fn is_on(&self) -> bool {
        self.share > 0.0 || self.wanted_share > 0.0
    }

    /// Forgets the past.
    pub(crate) fn reset(&mut self) {
        self.integrators = [0.0; 2];
    }

    /// Takes the bass off samples.
    pub(crate) fn process(&mut self, samples: &mut [f32]) {
        for x in samples {
            if self.corner_hz != self.target_hz {
                let next = self.corner_hz * (self.target_hz / self.corner_hz).powf(self.step);
                self.move_to(if (next / self.target_hz - 1.0).abs() < 1e-3 { self.target_hz } else { next });
            }
            self.share += (self.wanted_share - self.share).clamp(-self.step, self.step);
            let Coefficients { g, a } = self.coefficients;
            let [s1, s2] = self.integrators;
            let dry = f64::from(*x);
            let high = (dry - (SQRT_2 + g) * s1 - s2) * a;
            let band = g * high + s1;
            let low = g * band + s2;
            self.integrators = [g * high + band, g * band + low].map(|s| if s.abs() < DEAD { 0.0 } else { s });
            *x = single(if self.share == 1.0 { high } else { dry + self.share * (high - dry) });
        }
    }

    fn move_to(&mut self, corner_hz: f64) {
        self.corner_hz = corner_hz;
        self.coefficients = Coefficients::new(corner_hz, self.sample_rate_hz);
    }
}
