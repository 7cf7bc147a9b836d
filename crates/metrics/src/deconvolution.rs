//! The response between a dry sound and what ears heard of it.

use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex, forward, inverse};
use std::sync::Arc;

/// Steps of the descent at most, and the share of the first residual at which it ends.
const STEPS: usize = 48;
const DONE: f64 = 1e-9;
/// Added to the dry sound's power, a share of its mean: frequencies that hardly sound in it stay small in the response.
const REGULARISATION: f32 = 1e-5;
/// The dry sound's power is smoothed over this share of the transform's length.
const SMOOTHED: usize = 2048;

/// Responses of `length` samples, the first of which lies `before` samples ahead of the dry sound, that explain best what ears
/// heard: the least squares of what a convolution leaves of them. `None` where the dry sound is silent or the ears differ in
/// length.
///
/// The dry sound begins `pre_roll` samples before the ears do, so that what still sounds from then is explained too; division
/// of spectra would take it for noise. The normal equations are solved by conjugate gradients with the dry sound's spectrum as
/// a circulant preconditioner (Chan and Ng, "Conjugate gradient methods for Toeplitz systems", SIAM Review 38, 1996): as many
/// samples of the ears as the response has, or more, are needed.
#[must_use]
pub fn deconvolve(dry: &[f32], pre_roll: usize, ears: [&[f32]; 2], before: usize, length: usize) -> Option<[Vec<f32>; 2]> {
    let heard = ears[0].len();
    if heard != ears[1].len() || heard == 0 || length == 0 {
        return None;
    }
    let dry = &dry[..dry.len().min(pre_roll + heard + before)];
    let mut system = System::new(dry, pre_roll, heard, before, length)?;
    Some(ears.map(|ear| system.solve(ear)))
}

/// The convolution with a dry sound, as far as it is heard.
struct System {
    forward: Arc<dyn RealToComplex<f32>>,
    inverse: Arc<dyn ComplexToReal<f32>>,
    dry: Vec<Complex32>,
    /// Of the smoothed power, with the scale of transforms back.
    inverse_power: Vec<f32>,
    regularisation: f32,
    /// Where the ears begin in the transform, and how long they are.
    start: usize,
    heard: usize,
    length: usize,
    time: Vec<f32>,
    bins: Vec<Complex32>,
}

impl System {
    fn new(dry: &[f32], pre_roll: usize, heard: usize, before: usize, length: usize) -> Option<Self> {
        let start = pre_roll + before;
        let transform = transform_length((start + heard).max(dry.len() + length.saturating_sub(start)));
        let (forward, inverse) = (forward::<f32>(transform), inverse::<f32>(transform));
        let (mut time, mut bins) = (forward.make_input_vec(), forward.make_output_vec());
        time[..dry.len()].copy_from_slice(dry);
        let done = forward.process(&mut time, &mut bins);
        debug_assert!(done.is_ok());
        let power: Vec<f32> = bins.iter().map(|x| x.norm_sqr()).collect();
        let mean = power.iter().sum::<f32>() / power.len() as f32;
        if !(mean.is_finite() && mean > 0.0) {
            return None;
        }
        let regularisation = REGULARISATION * mean;
        // Not all of the dry sound's power is heard at once.
        let share = heard as f32 / dry.len() as f32;
        let smooth = smooth(&power, transform / SMOOTHED / 2);
        let inverse_power = smooth.iter().map(|p| 1.0 / (share * p + regularisation)).collect();
        Some(Self { dry: bins.clone(), inverse_power, regularisation, start, heard, length, forward, inverse, time, bins })
    }

    fn solve(&mut self, ear: &[f32]) -> Vec<f32> {
        let mut response = vec![0.0; self.length];
        let mut residual = self.heard_by(ear);
        let mut next = self.precondition(&residual);
        let mut direction = next.clone();
        let mut size = dot(&residual, &next);
        let first = size;
        for _ in 0..STEPS {
            if size <= DONE * first {
                break;
            }
            let sound = self.convolve(&direction);
            let bend = dot(&sound, &sound) + f64::from(self.regularisation) * dot(&direction, &direction);
            let step = (size / bend) as f32;
            let back = self.heard_by(&sound);
            for (((h, r), d), b) in response.iter_mut().zip(&mut residual).zip(&direction).zip(&back) {
                *h += step * d;
                *r -= step * (b + self.regularisation * d);
            }
            next = self.precondition(&residual);
            let before = std::mem::replace(&mut size, dot(&residual, &next));
            let turn = (size / before) as f32;
            direction.iter_mut().zip(&next).for_each(|(d, n)| *d = n + turn * *d);
        }
        response
    }

    /// The part of a response's sound that ears hear.
    fn convolve(&mut self, response: &[f32]) -> Vec<f32> {
        self.filtered(0, response, |x, dry, _| x * dry);
        self.time[self.start..self.start + self.heard].to_vec()
    }

    /// The transpose of [`Self::convolve`].
    fn heard_by(&mut self, sound: &[f32]) -> Vec<f32> {
        self.filtered(self.start, sound, |x, dry, _| x * dry.conj());
        self.time[..self.length].to_vec()
    }

    fn precondition(&mut self, residual: &[f32]) -> Vec<f32> {
        self.filtered(0, residual, |x, _, inverse_power| x * inverse_power);
        self.time[..self.length].to_vec()
    }

    /// Leaves in `time` what a filter makes of a signal that begins `at` some sample.
    fn filtered(&mut self, at: usize, signal: &[f32], filter: impl Fn(Complex32, Complex32, f32) -> Complex32) {
        self.time.fill(0.0);
        self.time[at..at + signal.len()].copy_from_slice(signal);
        let done = self.forward.process(&mut self.time, &mut self.bins);
        debug_assert!(done.is_ok());
        let scale = 1.0 / self.time.len() as f32;
        for ((x, dry), inverse_power) in self.bins.iter_mut().zip(&self.dry).zip(&self.inverse_power) {
            *x = filter(*x, *dry, *inverse_power) * scale;
        }
        if let [first, .., last] = self.bins.as_mut_slice() {
            (first.im, last.im) = (0.0, 0.0);
        }
        let done = self.inverse.process(&mut self.bins, &mut self.time);
        debug_assert!(done.is_ok());
    }
}

/// The next length of few small factors, even.
fn transform_length(least: usize) -> usize {
    let whole = least.max(16).next_power_of_two();
    [5 * whole / 8, 3 * whole / 4, whole].into_iter().find(|n| *n >= least).unwrap_or(whole)
}

/// Means over as many bins on both sides.
fn smooth(power: &[f32], reach: usize) -> Vec<f32> {
    let mut sums = Vec::with_capacity(power.len() + 1);
    let mut sum = 0.0_f64;
    sums.push(sum);
    for p in power {
        sum += f64::from(*p);
        sums.push(sum);
    }
    let mean = |k: usize| {
        let (from, to) = (k.saturating_sub(reach), (k + reach + 1).min(power.len()));
        ((sums[to] - sums[from]) / (to - from) as f64) as f32
    };
    (0..power.len()).map(mean).collect()
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_signals::noise;

    #[test]
    fn a_piece_of_running_sound_gives_the_response_it_was_convolved_with() {
        let (pre_roll, heard, before, length) = (2000, 3000, 40, 900);
        // Coloured, and with pauses.
        let mut last = 0.0;
        let dry: Vec<f32> = noise(1, pre_roll + heard)
            .iter()
            .enumerate()
            .map(|(i, x)| {
                last = 0.8 * last + x;
                if i % 1200 < 800 { last as f32 } else { 0.0 }
            })
            .collect();
        let room: Vec<f32> = noise(2, 700).iter().enumerate().map(|(i, x)| (*x * (-(i as f64) / 120.0).exp()) as f32).collect();
        let at = |lag: usize| lag + 30;
        let ear: Vec<f32> = (pre_roll..pre_roll + heard)
            .map(|t| room.iter().enumerate().filter_map(|(lag, h)| Some(h * dry.get(t.checked_sub(at(lag))?)?)).sum())
            .collect();
        let other: Vec<f32> = ear.iter().map(|x| -0.5 * x).collect();
        let [left, right] = deconvolve(&dry, pre_roll, [&ear, &other], before, length).unwrap();
        let energy: f32 = room.iter().map(|h| h * h).sum();
        let wanted = |i: usize| i.checked_sub(before + 30).and_then(|lag| room.get(lag)).copied().unwrap_or(0.0);
        let off: f32 = left.iter().enumerate().map(|(i, h)| (h - wanted(i)).powi(2)).sum();
        assert!(off < 1e-3 * energy, "{} dB", 10.0 * (off / energy).log10());
        let off: f32 = right.iter().zip(&left).map(|(r, l)| (r + 0.5 * l).powi(2)).sum();
        assert!(off < 1e-6 * energy);
        assert_eq!(deconvolve(&vec![0.0; 5000], pre_roll, [&ear, &other], before, length), None);
        assert_eq!(deconvolve(&dry, pre_roll, [&ear, &other[1..]], before, length), None);
    }
}
