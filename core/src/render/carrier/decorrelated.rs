//! Noise that two ears hear with the same magnitudes and other phases.

use crate::number::single;
use std::f64::consts::FRAC_PI_2;

/// Hops that what differs between the ears reaches to either side: with hops of 5 ms, phases change from one 50 Hz to the next,
/// which is within the bandwidth of hearing from 500 Hz on. It is short beside a decay, so that decays keep magnitudes alike.
const REACH: usize = 2;

/// A line of noise, and what it leaves of a filter that is odd in time.
///
/// An odd filter has an imaginary spectrum `iS`, so that sums and differences `a N ± b iS N` of a line with a spectrum `N` have
/// the same magnitudes at every frequency. With a mean of 1 of `S` squared, which changes its sign at random, their coherence
/// is `(a^2 - b^2) / (a^2 + b^2)`.
pub(super) struct Decorrelated {
    hop: usize,
    line: Vec<f32>,
    /// The filter from its middle on.
    odd: Vec<f32>,
}

impl Decorrelated {
    /// So many hops of unit energy, of two draws of standard normal noise.
    pub(super) fn new([of_line, of_filter]: [impl Iterator<Item = f32>; 2], hop: usize, hops: usize) -> Self {
        let reach = REACH * hop;
        let scale = 1.0 / (hop as f32).sqrt();
        let line = of_line.take(hops * hop + 2 * reach).map(|x| scale * x).collect();
        let window = |i: usize| single((FRAC_PI_2 * i as f64 / (reach + 1) as f64).cos());
        let mut odd: Vec<f32> = of_filter.take(reach).zip(1..).map(|(x, i)| window(i) * x).collect();
        let energy: f32 = odd.iter().map(|x| 2.0 * x * x).sum();
        odd.iter_mut().for_each(|x| *x /= energy.sqrt());
        Self { hop, line, odd }
    }

    /// Samples of one hop: of the line, and filtered.
    pub(super) fn hop(&self, number: usize) -> [Vec<f32>; 2] {
        let from = self.odd.len() + number * self.hop;
        let filtered = |i: usize| {
            let pairs = self.line[..i].iter().rev().zip(&self.line[i + 1..]).zip(&self.odd);
            pairs.map(|((before, after), gain)| gain * (before - after)).sum()
        };
        [self.line[from..from + self.hop].to_vec(), (from..from + self.hop).map(filtered).collect()]
    }
}
