//! Impulses at any times, coloured by bands, as one signal, and the way back from it to their derivatives.
//!
//! Each band's impulses are spread on a grid twice as fine as the samples by a Kaiser-Bessel kernel, whose transform is
//! divided out: a Fourier transform of type 1 at times that lie on no grid (Dutt and Rokhlin 1993; Fessler and Sutton 2003,
//! with beta = 2.34 J). Between the middles of bands amplitudes go along straight lines. A thousand impulses in 16 bands take
//! less than a millisecond.

use crate::bands::{BANDS, Bands};
use promenade_fourier::num_complex::Complex64;
use promenade_fourier::{ComplexToReal, RealToComplex, forward, inverse};
use std::sync::Arc;

/// Points of the grid that an impulse is spread over.
const WIDTH: usize = 6;
/// Shape of the kernel.
const BETA: f64 = 2.34 * WIDTH as f64;

/// Impulses: a time in seconds and an amplitude in each band.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Impulses {
    /// Seconds from the first sample.
    pub(crate) times_s: Vec<f64>,
    /// Amplitudes.
    pub(crate) gains: Vec<[f64; BANDS]>,
}

/// Plans and tables for signals of one length.
pub(crate) struct BandSignal {
    length: usize,
    sample_rate_hz: f64,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    /// Of each bin the band below and the share of the next.
    places: Vec<(usize, f64)>,
    /// One over the kernel's transform, and back by its delay, by bin.
    corrections: Vec<Complex64>,
}

/// Kernel and slope at a distance from its middle, grid points.
fn kernel(x: f64) -> (f64, f64) {
    let u = 2.0 * x / WIDTH as f64;
    let inside = 1.0 - u * u;
    if inside <= 0.0 {
        return (0.0, 0.0);
    }
    let root = inside.sqrt();
    let norm = 1.0 / bessel_0(BETA);
    let slope = -BETA * bessel_1(BETA * root) * (u / root.max(1e-12)) * 2.0 / WIDTH as f64;
    (bessel_0(BETA * root) * norm, slope * norm)
}

/// Modified Bessel function of order 0, by its series.
fn bessel_0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    let q = 0.25 * x * x;
    for k in 1..64 {
        term *= q / f64::from(k * k);
        sum += term;
    }
    sum
}

/// Of order 1.
fn bessel_1(x: f64) -> f64 {
    let (mut term, mut sum) = (0.5 * x, 0.5 * x);
    let q = 0.25 * x * x;
    for k in 1..64 {
        term *= q / f64::from(k * (k + 1));
        sum += term;
    }
    sum
}

/// Kernel values at steps of a fraction of a point, for looking up.
struct Table(Vec<(f64, f64)>);

const STEPS: usize = 256;

impl Table {
    fn new() -> Self {
        let half = WIDTH as f64 / 2.0;
        Self((0..=WIDTH * STEPS + 1).map(|i| kernel(i as f64 / STEPS as f64 - half)).collect())
    }

    fn at(&self, x: f64) -> (f64, f64) {
        let place = ((x + WIDTH as f64 / 2.0) * STEPS as f64).clamp(0.0, (WIDTH * STEPS) as f64);
        let below = place as usize;
        let fraction = place - below as f64;
        let (a, b) = (self.0[below], self.0[below + 1]);
        (a.0 + fraction * (b.0 - a.0), a.1 + fraction * (b.1 - a.1))
    }
}

fn table() -> &'static Table {
    static TABLE: std::sync::OnceLock<Table> = std::sync::OnceLock::new();
    TABLE.get_or_init(Table::new)
}

impl BandSignal {
    /// For signals of `length` samples, an even number.
    #[must_use]
    pub(crate) fn new(length: usize, sample_rate_hz: f64, bands: &Bands) -> Self {
        let fine = 2 * length;
        let bins = length / 2 + 1;
        // The kernel's transform, by its sum over the table.
        let table = table();
        let transform = |k: usize| {
            let w = std::f64::consts::TAU * k as f64 / fine as f64;
            let sum: f64 =
                (0..=WIDTH * STEPS).map(|i| table.0[i].0 * (w * (i as f64 / STEPS as f64 - WIDTH as f64 / 2.0)).cos()).sum();
            sum / STEPS as f64
        };
        Self {
            length,
            sample_rate_hz,
            forward: forward(fine),
            inverse: inverse(fine),
            places: (0..bins).map(|k| bands.place(k as f64 * sample_rate_hz / length as f64)).collect(),
            corrections: (0..bins).map(|k| Complex64::from(1.0 / transform(k))).collect(),
        }
    }

    /// Samples of the signals.
    #[must_use]
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// First grid point and distance from it of a time; none outside of the signal.
    fn start(&self, time_s: f64) -> Option<(usize, f64)> {
        let at = 2.0 * time_s * self.sample_rate_hz;
        (at >= 0.0 && at < (2 * self.length - WIDTH) as f64).then(|| {
            // The points from just above at - WIDTH / 2 on; the grid is a circle.
            let first = (at - WIDTH as f64 / 2.0).ceil();
            let fine = 2 * self.length;
            let index = if first < 0.0 { fine - (-first) as usize } else { first as usize };
            (index % fine, first - at)
        })
    }

    /// The spectrum of all impulses, bins 0 to half the length.
    #[must_use]
    pub(crate) fn spectrum(&self, of: &Impulses) -> Vec<Complex64> {
        let fine = 2 * self.length;
        let table = table();
        let mut grids = vec![0.0; BANDS * fine];
        for (time, gains) in of.times_s.iter().zip(&of.gains) {
            let Some((first, from)) = self.start(*time) else { continue };
            for i in 0..WIDTH {
                let weight = table.at(from + i as f64).0;
                let point = (first + i) % fine;
                for (b, gain) in gains.iter().enumerate() {
                    grids[b * fine + point] += weight * gain;
                }
            }
        }
        let mut sum = vec![Complex64::default(); self.length / 2 + 1];
        let mut bins = self.forward.make_output_vec();
        for (b, grid) in grids.chunks_exact_mut(fine).enumerate() {
            let done = self.forward.process(grid, &mut bins);
            debug_assert!(done.is_ok());
            for ((s, bin), (below, fraction)) in sum.iter_mut().zip(&bins).zip(&self.places) {
                let share = if *below == b {
                    1.0 - fraction
                } else if below + 1 == b {
                    *fraction
                } else {
                    continue;
                };
                *s += bin * share;
            }
        }
        sum.iter_mut().zip(&self.corrections).for_each(|(s, c)| *s *= c);
        sum
    }

    /// Derivatives by amplitudes and by times (per second) of a number whose derivative by the real and imaginary parts of
    /// each bin is given as a complex number.
    #[must_use]
    pub(crate) fn back(&self, of: &Impulses, by_bins: &[Complex64]) -> (Vec<[f64; BANDS]>, Vec<f64>) {
        let fine = 2 * self.length;
        let table = table();
        let mut grids = vec![0.0; BANDS * fine];
        let mut bins = self.inverse.make_input_vec();
        for (b, grid) in grids.chunks_exact_mut(fine).enumerate() {
            bins.fill(Complex64::default());
            for (k, ((by, (below, fraction)), c)) in by_bins.iter().zip(&self.places).zip(&self.corrections).enumerate() {
                let share = if *below == b {
                    1.0 - fraction
                } else if below + 1 == b {
                    *fraction
                } else {
                    continue;
                };
                // The transform back counts every bin but the ends twice.
                let half = if k == 0 { 1.0 } else { 0.5 };
                bins[k] = by * c * (share * half);
            }
            bins[0].im = 0.0;
            let done = self.inverse.process(&mut bins, grid);
            debug_assert!(done.is_ok());
        }
        let mut by_gains = vec![[0.0; BANDS]; of.times_s.len()];
        let mut by_times = vec![0.0; of.times_s.len()];
        for (n, (time, gains)) in of.times_s.iter().zip(&of.gains).enumerate() {
            let Some((first, from)) = self.start(*time) else { continue };
            for i in 0..WIDTH {
                let (weight, slope) = table.at(from + i as f64);
                let point = (first + i) % fine;
                let mut along = 0.0;
                for (b, gain) in gains.iter().enumerate() {
                    let value = grids[b * fine + point];
                    by_gains[n][b] += weight * value;
                    along += gain * value;
                }
                by_times[n] -= slope * along;
            }
            by_times[n] *= 2.0 * self.sample_rate_hz;
        }
        (by_gains, by_times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Random;

    fn impulses() -> Impulses {
        let mut random = Random::new(3, 0);
        let times_s = (0..20).map(|_| 0.001 + 0.012 * random.uniform()).collect();
        let gains = (0..20).map(|_| std::array::from_fn(|_| random.normal())).collect();
        Impulses { times_s, gains }
    }

    #[test]
    fn it_is_the_sum_of_exponentials_between_samples() {
        let (bands, rate) = (Bands::new(16_000.0), 16_000.0);
        let signal = BandSignal::new(256, rate, &bands);
        let of = impulses();
        for (k, found) in signal.spectrum(&of).iter().enumerate().take(122) {
            let hz = k as f64 * rate / 256.0;
            let (below, fraction) = bands.place(hz);
            let meant: Complex64 = of
                .times_s
                .iter()
                .zip(&of.gains)
                .map(|(t, g)| {
                    let gain = g[below] * (1.0 - fraction) + g[below + 1] * fraction;
                    Complex64::from_polar(1.0, -std::f64::consts::TAU * hz * t) * gain
                })
                .sum();
            assert!((found - meant).norm() < 2e-3, "bin {k}: {found} for {meant}");
        }
    }

    #[test]
    fn derivatives_are_those_of_small_steps() {
        let signal = BandSignal::new(256, 16_000.0, &Bands::new(16_000.0));
        let of = impulses();
        let mut random = Random::new(4, 0);
        let by: Vec<Complex64> = (0..129)
            .map(|k| if k < 120 { Complex64::new(random.normal(), random.normal()) } else { Complex64::default() })
            .collect();
        let value =
            |of: &Impulses| -> f64 { signal.spectrum(of).iter().zip(&by).map(|(s, b)| s.re * b.re + s.im * b.im).sum() };
        let (by_gains, by_times) = signal.back(&of, &by);
        for n in [0, 7, 19] {
            let mut moved = of.clone();
            moved.times_s[n] += 1e-8;
            let mut other = of.clone();
            other.times_s[n] -= 1e-8;
            let step = (value(&moved) - value(&other)) / 2e-8;
            assert!((step / by_times[n] - 1.0).abs() < 2e-2, "time {n}: {step} {}", by_times[n]);
            let mut moved = of.clone();
            moved.gains[n][5] += 1e-3;
            let step = (value(&moved) - value(&of)) / 1e-3;
            assert!((step - by_gains[n][5]).abs() < 1e-6, "gain {n}: {step} {}", by_gains[n][5]);
        }
    }
}
