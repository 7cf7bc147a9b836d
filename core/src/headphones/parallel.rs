//! A filter of given levels as sections in parallel whose poles are set beforehand (B. Bank, "Perceptually motivated audio
//! equalization using fixed-pole parallel second-order filters", IEEE Signal Processing Letters 15, 2008).

use super::{HEADPHONE_POINTS, level_at};
use crate::number::whole;
use promenade_fourier::minimum_phase_log;
use promenade_fourier::num_complex::Complex64;

/// Pairs of poles an octave.
const POLES_PER_OCTAVE: f64 = 6.0;
/// Frequencies an octave that the levels are matched at.
const MATCHED_PER_OCTAVE: f64 = 36.0;
/// Frequencies of the first pair and of the first match, Hz; the last are these shares of the sample rate.
const FIRST_HZ: f64 = 15.0;
const LAST_SHARE: f64 = 0.47;
const LAST_MATCH: f64 = 0.495;
/// What is added to the diagonal of the equations, of its largest value.
const RIDGE: f64 = 1e-11;

/// Sections of second order in parallel, and the input itself.
#[derive(Clone, Debug)]
pub(super) struct Parallel {
    through: f64,
    sections: Vec<Section>,
}

/// `(d0 + d1 z^-1) / (1 + a1 z^-1 + a2 z^-2)`
#[derive(Clone, Copy, Debug)]
struct Section {
    d: [f64; 2],
    a: [f64; 2],
    past: [f64; 2],
}

impl Parallel {
    /// The minimum-phase filter of these levels.
    pub(super) fn fit(levels_db: &[f32; HEADPHONE_POINTS], sample_rate_hz: f64) -> Self {
        // Bins of at most 2 Hz.
        let n_fft = whole(0.5 * sample_rate_hz).next_power_of_two();
        let bin_hz = sample_rate_hz / n_fft as f64;
        let nepers = std::f64::consts::LN_10 / 20.0;
        let target = minimum_phase_log((0..=n_fft / 2).map(|k| nepers * level_at(levels_db, k as f64 * bin_hz)), n_fft);
        let angle = std::f64::consts::TAU / sample_rate_hz;
        let poles: Vec<[f64; 2]> = frequencies(POLES_PER_OCTAVE, LAST_SHARE * sample_rate_hz)
            .map(|hz| {
                // Twice as wide as the poles are apart: narrower ones leave ripples between them (as wide, 0.3 dB).
                let radius = (-angle * hz * ((0.5 / POLES_PER_OCTAVE).exp2() - (-0.5 / POLES_PER_OCTAVE).exp2())).exp();
                [-2.0 * radius * (angle * hz).cos(), radius * radius]
            })
            .collect();
        let count = 2 * poles.len() + 1;
        let (mut normal, mut wanted) = (vec![0.0; count * count], vec![0.0; count]);
        let mut row = vec![Complex64::default(); count];
        for hz in frequencies(MATCHED_PER_OCTAVE, LAST_MATCH * sample_rate_hz) {
            let place = hz / bin_hz;
            let bin = whole(place).min(target.len() - 2);
            let gain = (target[bin] + (target[bin + 1] - target[bin]) * (place - bin as f64)).exp();
            // Divided by what is wanted, so that errors count in dB.
            let delay = Complex64::from_polar(1.0, -angle * hz);
            row[0] = gain.inv();
            for (pair, [a1, a2]) in row[1..].chunks_exact_mut(2).zip(&poles) {
                pair[0] = (gain * (delay * delay * *a2 + delay * *a1 + 1.0)).inv();
                pair[1] = pair[0] * delay;
            }
            for (i, a) in row.iter().enumerate() {
                wanted[i] += a.re;
                for (sum, b) in normal[i * count..].iter_mut().zip(&row[..=i]) {
                    *sum += a.re * b.re + a.im * b.im;
                }
            }
        }
        let d = solved(&mut normal, wanted);
        let sections = d[1..].as_chunks::<2>().0.iter().zip(poles).map(|(d, a)| Section { d: *d, a, past: [0.0; 2] });
        Self { through: d[0], sections: sections.collect() }
    }

    pub(super) fn next(&mut self, x: f64) -> f64 {
        let mut y = self.through * x;
        for Section { d, a, past } in &mut self.sections {
            let now = x - a[0] * past[0] - a[1] * past[1];
            y += d[0] * now + d[1] * past[0];
            *past = [if now.abs() < 1e-20 { 0.0 } else { now }, past[0]];
        }
        y
    }

    pub(super) fn reset(&mut self) {
        self.sections.iter_mut().for_each(|section| section.past = [0.0; 2]);
    }
}

/// Frequencies so many an octave, up to the last.
fn frequencies(per_octave: f64, last_hz: f64) -> impl Iterator<Item = f64> {
    let count = whole(per_octave * (last_hz / FIRST_HZ).max(2.0).log2()).max(2);
    (0..=count).map(move |i| FIRST_HZ * (last_hz / FIRST_HZ).max(2.0).powf(i as f64 / count as f64))
}

/// Solves a symmetric system whose lower triangle is given row by row, by Cholesky's method; each unknown is brought to one
/// scale first.
fn solved(matrix: &mut [f64], mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / matrix[i * n + i].max(f64::MIN_POSITIVE).sqrt()).collect();
    for i in 0..n {
        right[i] *= scale[i];
        for j in 0..=i {
            matrix[i * n + j] *= scale[i] * scale[j];
        }
        matrix[i * n + i] += RIDGE;
    }
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            let rest = matrix[i * n + j] - sum;
            matrix[i * n + j] = if i == j { rest.max(RIDGE * RIDGE).sqrt() } else { rest / matrix[j * n + j] };
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| matrix[i * n + k] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| matrix[k * n + i] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i * n + i];
    }
    right.iter().zip(&scale).map(|(x, scale)| x * scale).collect()
}
