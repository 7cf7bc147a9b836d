//! Streaming short-time Fourier transform: one channel in, two out, any hop.

use crate::StftGrid;
use crate::number::single;
use promenade_fourier::num_complex::Complex32;
use promenade_fourier::{ComplexToReal, RealToComplex};
use std::ops::Range;
use std::sync::Arc;

/// A one-sided spectrum as the transform makes it, bins from 0 Hz to Nyquist.
pub(crate) type Spectrum = Vec<Complex32>;

impl StftGrid {
    /// Length of the analysis window: the transform's length less one hop, which is left to the filters' responses.
    pub(crate) fn window_len(&self) -> usize {
        self.n_fft - self.hop
    }

    /// Samples by which a stream lags behind through analysis and synthesis.
    #[must_use]
    pub fn latency_samples(&self) -> usize {
        self.window_len() + self.lead()
    }
}

/// Analysis of a mono stream into frames.
///
/// A frame is a window of input with zeros around it: [`StftGrid::lead`] samples before and the rest of a hop after. A filter
/// whose response fits there acts on the frame without wrapping round, so a constant filter is exactly time-invariant, and a
/// filter that changes from frame to frame is cross-faded by the windows. The window is a B-spline (support three hops for a
/// transform of four), which reproduces a filter that moves in a straight line (Unser 1999); dividing by the running sum of
/// windows makes any hop add up to one.
pub(crate) struct Analysis {
    grid: StftGrid,
    window: Vec<f32>,
    /// The newest input, one window long, oldest first.
    input: Vec<f32>,
    frame: Vec<f32>,
    scratch: Vec<Complex32>,
    forward: Arc<dyn RealToComplex<f32>>,
}

impl Analysis {
    pub(crate) fn new(grid: StftGrid) -> Self {
        let forward = promenade_fourier::forward(grid.n_fft);
        Self {
            grid,
            window: window(&grid),
            input: vec![0.0; grid.window_len()],
            frame: vec![0.0; grid.n_fft],
            scratch: vec![Complex32::default(); forward.get_scratch_len()],
            forward,
        }
    }

    /// The place for the newest hop of input; fill it, then call [`Analysis::analyse`].
    pub(crate) fn newest(&mut self) -> &mut [f32] {
        let at = self.input.len() - self.grid.hop;
        &mut self.input[at..]
    }

    /// Transforms the newest frame and moves on by a hop.
    pub(crate) fn analyse(&mut self, spectrum: &mut [Complex32]) {
        let Range { start, end } = self.grid.lead()..self.grid.lead() + self.input.len();
        self.frame[..start].fill(0.0);
        self.frame[end..].fill(0.0);
        for ((f, x), w) in self.frame[start..end].iter_mut().zip(&self.input).zip(&self.window) {
            *f = x * w;
        }
        // The lengths are fixed at construction, so the transform's only error cannot occur.
        let done = self.forward.process_with_scratch(&mut self.frame, spectrum, &mut self.scratch);
        debug_assert!(done.is_ok());
        self.input.copy_within(self.grid.hop.., 0);
    }

    pub(crate) fn reset(&mut self) {
        self.input.fill(0.0);
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.window) + size_of_val(&*self.input) + size_of_val(&*self.frame) + size_of_val(&*self.scratch)
    }
}

/// Overlap-add of two ears' frames into streams.
pub(crate) struct Synthesis {
    grid: StftGrid,
    /// Sums of both ears, oldest first.
    sums: [Vec<f32>; 2],
    frame: Vec<f32>,
    scratch: Vec<Complex32>,
    inverse: Arc<dyn ComplexToReal<f32>>,
}

impl Synthesis {
    pub(crate) fn new(grid: StftGrid) -> Self {
        let n = grid.n_fft;
        let inverse = promenade_fourier::inverse(n);
        let scratch = vec![Complex32::default(); inverse.get_scratch_len()];
        Self { grid, sums: [vec![0.0; n], vec![0.0; n]], frame: vec![0.0; n], scratch, inverse }
    }

    /// Adds one frame of an ear and gives out the hop that is complete with it. The spectrum is overwritten.
    pub(crate) fn synthesise(&mut self, ear: usize, spectrum: &mut [Complex32], out: &mut [f32]) {
        // A real signal's end bins are real; the inverse transform insists on it.
        spectrum[0].im = 0.0;
        spectrum[self.grid.n_fft / 2].im = 0.0;
        let done = self.inverse.process_with_scratch(spectrum, &mut self.frame, &mut self.scratch);
        debug_assert!(done.is_ok());
        for (s, f) in self.sums[ear].iter_mut().zip(&self.frame) {
            *s += f;
        }
        self.give_out(ear, out);
    }

    /// Moves on by a hop without adding a frame.
    pub(crate) fn give_out(&mut self, ear: usize, out: &mut [f32]) {
        let sums = &mut self.sums[ear];
        let hop = self.grid.hop;
        out.copy_from_slice(&sums[..hop]);
        sums.copy_within(hop.., 0);
        let kept = sums.len() - hop;
        sums[kept..].fill(0.0);
    }

    pub(crate) fn reset(&mut self) {
        self.sums.iter_mut().for_each(|s| s.fill(0.0));
    }
}

/// The highest order of a window's spline: hops far shorter than the window would make it a spike.
const HIGHEST_ORDER: usize = 8;

/// B-spline of an order that fits the window, its boxes no shorter than a hop, divided by the sum of its copies a hop apart and
/// by the transform length, which the inverse transform leaves in.
fn window(grid: &StftGrid) -> Vec<f32> {
    let len = grid.window_len();
    let order = (len / grid.hop).clamp(1, HIGHEST_ORDER);
    // A box repeated: its convolution with itself is the spline. Boxes of unequal length fill a window that hops do not divide.
    let mut spline = vec![1.0_f64];
    for i in 0..order {
        let box_len = len / order + usize::from(i < len % order);
        spline = boxed(&spline, box_len);
    }
    spline.resize(len, 0.0);
    let sum = |i: usize| spline.iter().skip(i % grid.hop).step_by(grid.hop).sum::<f64>();
    let sums: Vec<f64> = (0..grid.hop).map(sum).collect();
    (0..len).map(|i| single(spline[i] / (sums[i % grid.hop] * grid.n_fft as f64))).collect()
}

/// Convolution with a box, by running sums.
fn boxed(values: &[f64], box_len: usize) -> Vec<f64> {
    let mut sum = 0.0;
    let at = |i: usize| values.get(i).unwrap_or(&0.0);
    (0..values.len() + box_len - 1)
        .map(|i| {
            sum += at(i) - i.checked_sub(box_len).map_or(&0.0, at);
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(grid: StftGrid) -> f32 {
        let (mut analysis, mut synthesis) = (Analysis::new(grid), Synthesis::new(grid));
        let x = promenade_testing::noise(1, 20 * grid.n_fft);
        let mut spectrum = vec![Complex32::default(); grid.bins()];
        let (mut y, mut out) = (Vec::new(), vec![0.0; grid.hop]);
        for chunk in x.chunks_exact(grid.hop) {
            analysis.newest().copy_from_slice(chunk);
            analysis.analyse(&mut spectrum);
            synthesis.synthesise(0, &mut spectrum, &mut out);
            y.extend_from_slice(&out);
        }
        // What is given out with a frame would be heard during the next hop: a hop of the latency has passed already.
        let lag = grid.latency_samples() - grid.hop;
        assert!(y.iter().take(lag).all(|v| v.abs() < 1e-6));
        y.iter().skip(lag).zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn an_unchanged_spectrum_comes_back_for_any_hop() {
        for (n_fft, hop) in [(320, 80), (512, 127), (512, 256), (960, 240), (1024, 100), (882, 221)] {
            let error = round_trip(StftGrid { sample_rate_hz: 48_000.0, n_fft, hop });
            // Round-off of a transform pair in f32 is about 1e-6 of full scale.
            assert!(error < 3e-6, "{n_fft}/{hop}: {error}");
        }
    }
}
