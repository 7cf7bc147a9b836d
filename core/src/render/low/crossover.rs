//! Two halves of a sound that add up to an all-pass (S. Linkwitz and R. Riley 1976), of eighth order: each a Butterworth filter
//! of fourth order twice, so that the lower is [`wave_share`](crate::wave_share) of the whole.

use std::f64::consts::PI;

/// States below this have died away: what follows would be subnormal.
const DEAD: f64 = 1e-20;
/// Stages of second order of a Butterworth filter of fourth.
const STAGES: usize = 2;

/// A filter of second order by trapezoidal integration (Zavalishin, "The Art of VA Filter Design" (2012), ch. 4).
#[derive(Clone, Copy, Default)]
struct Stage {
    integrators: [f64; 2],
}

/// What a stage does.
#[derive(Clone, Copy)]
struct Coefficients {
    g: f64,
    damping: f64,
    a: f64,
}

/// Splits one stream.
pub(crate) struct Crossover {
    coefficients: [Coefficients; STAGES],
    /// The first of both halves, then those of the low and those of the high half.
    first: Stage,
    low: [Stage; 2 * STAGES - 1],
    high: [Stage; 2 * STAGES - 1],
}

impl Stage {
    /// The low and the high half.
    fn split(&mut self, x: f64, Coefficients { g, damping, a }: Coefficients) -> [f64; 2] {
        let [s1, s2] = self.integrators;
        let high = (x - (damping + g) * s1 - s2) * a;
        let band = g * high + s1;
        let low = g * band + s2;
        self.integrators = [g * high + band, g * band + low].map(|s| if s.abs() < DEAD { 0.0 } else { s });
        [low, high]
    }
}

impl Crossover {
    pub(crate) fn new(crossover_hz: f64, sample_rate_hz: f64) -> Self {
        let g = (PI * (crossover_hz / sample_rate_hz).min(0.45)).tan();
        let coefficients = std::array::from_fn(|i| {
            let damping = 2.0 * ((2 * i + 1) as f64 * PI / (4 * STAGES) as f64).cos();
            Coefficients { g, damping, a: 1.0 / (1.0 + g * (g + damping)) }
        });
        Self { coefficients, first: Stage::default(), low: Default::default(), high: Default::default() }
    }

    /// The low and the high half of a sample.
    pub(crate) fn split(&mut self, x: f64) -> [f64; 2] {
        let [one, other] = self.coefficients;
        let [mut low, mut high] = self.first.split(x, one);
        for ((by, at_low), at_high) in [other, one, other].into_iter().zip(&mut self.low).zip(&mut self.high) {
            low = at_low.split(low, by)[0];
            high = at_high.split(high, by)[1];
        }
        [low, high]
    }

    pub(crate) fn reset(&mut self) {
        (self.first, self.low, self.high) = Default::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wave_share;
    use promenade_fourier::forward;

    #[test]
    fn the_halves_are_the_shares_of_waves_and_the_rest_and_meet_in_phase() {
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
            let share = wave_share(k as f64 * 48_000.0 / n as f64, 180.0) as f32;
            assert!((low.norm() - share).abs() < 1e-3, "bin {k}: {} for {share}", low.norm());
            if low.norm() > 1e-3 && high.norm() > 1e-3 {
                assert!((low / high).im.abs() < 0.01 * (low / high).norm(), "bin {k}");
            }
        }
    }
}
