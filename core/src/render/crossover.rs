//! Two halves of a sound that add up to an all-pass (S. Linkwitz and R. Riley 1976), of fourth order.

use std::f64::consts::{PI, SQRT_2};

/// States below this have died away: what follows would be subnormal.
const DEAD: f64 = 1e-20;

/// A filter of second order (Butterworth) by trapezoidal integration (Zavalishin, "The Art of VA Filter Design" (2012), ch. 4).
#[derive(Clone, Copy, Default)]
struct Stage {
    integrators: [f64; 2],
}

/// Splits one stream.
pub(crate) struct Crossover {
    g: f64,
    a: f64,
    /// The first of both halves, then the second of each.
    stages: [Stage; 3],
}

impl Stage {
    /// The low and the high half.
    fn split(&mut self, x: f64, g: f64, a: f64) -> [f64; 2] {
        let [s1, s2] = self.integrators;
        let high = (x - (SQRT_2 + g) * s1 - s2) * a;
        let band = g * high + s1;
        let low = g * band + s2;
        self.integrators = [g * high + band, g * band + low].map(|s| if s.abs() < DEAD { 0.0 } else { s });
        [low, high]
    }
}

impl Crossover {
    pub(crate) fn new(crossover_hz: f64, sample_rate_hz: f64) -> Self {
        let g = (PI * (crossover_hz / sample_rate_hz).min(0.45)).tan();
        Self { g, a: 1.0 / (1.0 + g * (g + SQRT_2)), stages: [Stage::default(); 3] }
    }

    /// The low and the high half of a sample.
    pub(crate) fn split(&mut self, x: f64) -> [f64; 2] {
        let (g, a) = (self.g, self.a);
        let [first, second, third] = &mut self.stages;
        let [low, high] = first.split(x, g, a);
        [second.split(low, g, a)[0], third.split(high, g, a)[1]]
    }

    pub(crate) fn reset(&mut self) {
        self.stages = [Stage::default(); 3];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_fourier::forward;

    #[test]
    fn the_halves_add_up_to_a_flat_whole_and_meet_in_phase() {
        let mut crossover = Crossover::new(180.0, 48_000.0);
        let n = 1 << 15;
        let plan = forward(n);
        let halves: Vec<[f64; 2]> = (0..n).map(|i| crossover.split(f64::from(u8::from(i == 0)))).collect();
        let spectra = [0, 1].map(|half| {
            let mut time: Vec<f32> = halves.iter().map(|h| h[half] as f32).collect();
            let mut bins = plan.make_output_vec();
            plan.process(&mut time, &mut bins).unwrap();
            bins
        });
        for k in (10..n / 4).step_by(7) {
            let (low, high) = (spectra[0][k], spectra[1][k]);
            assert!((20.0 * (low + high).norm().log10()).abs() < 0.01, "bin {k}");
            if low.norm() > 1e-3 && high.norm() > 1e-3 {
                assert!((low / high).im.abs() < 0.01 * (low / high).norm(), "bin {k}");
            }
        }
        let octave_up = (360.0 * n as f64 / 48_000.0) as usize;
        assert!((20.0 * spectra[0][octave_up].norm().log10() + 24.6).abs() < 0.3);
    }
}
