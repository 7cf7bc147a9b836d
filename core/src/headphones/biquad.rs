//! Sections of second order.

use super::{EqFilter, EqKind};

/// Filters of an equaliser by the bilinear transform (R. Bristow-Johnson, "Cookbook formulae for audio equalizer biquad filter
/// coefficients"), in transposed direct form II.
#[derive(Clone, Copy, Debug)]
pub(super) struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    past: [f64; 2],
}

impl Biquad {
    /// Of a filter below half the sample rate, Hz.
    pub(super) fn of(filter: &EqFilter, sample_rate_hz: f64) -> Self {
        let root = 10.0_f64.powf(filter.gain_db / 40.0);
        let (sin, cos) = (std::f64::consts::TAU * filter.hz / sample_rate_hz).sin_cos();
        let alpha = sin / (2.0 * filter.q);
        // A high shelf is a low shelf with the frequency axis turned round.
        let shelf = |side: f64| {
            let (sum, difference, slope) = (root + 1.0, (root - 1.0) * side, 2.0 * root.sqrt() * alpha);
            let b = [
                root * (sum - difference * cos + slope),
                2.0 * root * (difference - sum * cos),
                root * (sum - difference * cos - slope),
            ];
            let a = [sum + difference * cos + slope, -2.0 * (difference + sum * cos), sum + difference * cos - slope];
            (b, a)
        };
        let plain = [1.0 + alpha, -2.0 * cos, 1.0 - alpha];
        let (b, a) = match filter.kind {
            EqKind::Peak => {
                ([1.0 + alpha * root, -2.0 * cos, 1.0 - alpha * root], [1.0 + alpha / root, -2.0 * cos, 1.0 - alpha / root])
            }
            EqKind::LowShelf => shelf(1.0),
            EqKind::HighShelf => shelf(-1.0),
            EqKind::LowPass => ([0.5 * (1.0 - cos), 1.0 - cos, 0.5 * (1.0 - cos)], plain),
            EqKind::HighPass => ([0.5 * (1.0 + cos), -1.0 - cos, 0.5 * (1.0 + cos)], plain),
            // 0 dB at its middle.
            EqKind::BandPass => ([alpha, 0.0, -alpha], plain),
            EqKind::Notch => ([1.0, -2.0 * cos, 1.0], plain),
            EqKind::AllPass => ([1.0 - alpha, -2.0 * cos, 1.0 + alpha], plain),
        };
        Self { b: b.map(|b| b / a[0]), a: [a[1] / a[0], a[2] / a[0]], past: [0.0; 2] }
    }

    /// Level at a frequency as a share of the sample rate, dB.
    pub(super) fn level_db(&self, share: f64) -> f64 {
        let (sine, cosine) = (std::f64::consts::TAU * share).sin_cos();
        let (sine2, cosine2) = (2.0 * sine * cosine, 2.0 * cosine * cosine - 1.0);
        let energy = |[c0, c1, c2]: [f64; 3]| (c0 + c1 * cosine + c2 * cosine2).powi(2) + (c1 * sine + c2 * sine2).powi(2);
        10.0 * (energy(self.b).max(1e-30) / energy([1.0, self.a[0], self.a[1]]).max(1e-30)).log10()
    }

    pub(super) fn next(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.past[0];
        self.past = [self.b[1] * x - self.a[0] * y + self.past[1], self.b[2] * x - self.a[1] * y];
        // What is below -400 dB is nothing: numbers that small are slow.
        self.past.iter_mut().for_each(|v| *v = if v.abs() < 1e-20 { 0.0 } else { *v });
        y
    }

    pub(super) fn reset(&mut self) {
        self.past = [0.0; 2];
    }
}
