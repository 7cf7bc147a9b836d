//! Derivatives by a layer's weights: correlations of the derivatives by its outputs with its inputs, over all bins and frames.

use crate::published::frames::{Frames, MARGIN};
use crate::simd::LANES;
use pulp::Simd;

/// Taps that are worked on at a time.
const TOGETHER: usize = 3;

/// A place of a kernel and the plane that it reads.
#[derive(Clone, Copy)]
pub(super) struct Tap {
    /// Of the kernel's frames.
    pub(super) frame: usize,
    pub(super) plane: usize,
    /// Of the kernel's bins.
    pub(super) bin: usize,
}

/// For one frame, the first row of the outputs and the first row of the inputs at each frame of the kernel.
#[derive(Clone, Copy)]
pub(super) struct Place<const SIZE: usize> {
    pub(super) output: usize,
    pub(super) inputs: [usize; SIZE],
}

/// Sums over bins and frames of every output times every tap's input.
pub(super) struct Correlation<const SIZE: usize> {
    outputs: usize,
    taps: Vec<Tap>,
    /// `[tap][output][LANES]`.
    sums: Vec<f32>,
}

impl<const SIZE: usize> Correlation<SIZE> {
    /// All taps of a kernel of `SIZE` bins by `SIZE` frames on so many planes; outputs are a multiple of 8.
    pub(super) fn new(outputs: usize, planes: usize) -> Self {
        let tap = |i: usize| Tap { plane: i / (SIZE * SIZE), frame: i / SIZE % SIZE, bin: i % SIZE };
        Self::with_taps(outputs, (0..planes * SIZE * SIZE).map(tap).collect())
    }

    pub(super) fn with_taps(outputs: usize, mut taps: Vec<Tap>) -> Self {
        while let Some(last) = taps.last().filter(|_| !taps.len().is_multiple_of(TOGETHER)) {
            taps.push(*last);
        }
        Self { outputs, sums: vec![0.0; taps.len() * outputs * LANES], taps }
    }

    pub(super) fn clear(&mut self) {
        self.sums.fill(0.0);
    }

    /// The sum of an output and a tap, counted as in [`Correlation::new`].
    pub(super) fn sum(&self, output: usize, tap: usize) -> f32 {
        self.sums[(tap * self.outputs + output) * LANES..][..LANES].iter().sum()
    }

    /// Adds some frames. Rows must have zeros around them.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, outputs: &Frames, inputs: &Frames, places: &[Place<SIZE>]) {
        if S::REGISTER_COUNT >= 32 {
            self.add_tiles::<S, 8>(simd, outputs, inputs, places);
        } else {
            self.add_tiles::<S, 4>(simd, outputs, inputs, places);
        }
    }

    #[inline(always)]
    fn add_tiles<S: Simd, const O: usize>(&mut self, simd: S, outputs: &Frames, inputs: &Frames, places: &[Place<SIZE>]) {
        let len = outputs.len().next_multiple_of(S::F32_LANES);
        let chunk = self.outputs * LANES;
        for output in (0..self.outputs).step_by(O) {
            let sums = self.sums.chunks_exact_mut(TOGETHER * chunk);
            for (taps, sums) in self.taps.as_chunks::<TOGETHER>().0.iter().zip(sums) {
                let mut acc = [[simd.splat_f32s(0.0); TOGETHER]; O];
                for place in places {
                    let mut y: [&[S::f32s]; O] = [&[]; O];
                    for (o, y) in y.iter_mut().enumerate() {
                        *y = S::as_simd_f32s(&outputs.padded(place.output + output + o)[MARGIN..][..len]).0;
                    }
                    let mut x: [&[S::f32s]; TOGETHER] = [&[]; TOGETHER];
                    for (x, Tap { frame, plane, bin }) in x.iter_mut().zip(taps) {
                        let from = MARGIN + bin - SIZE / 2;
                        *x = S::as_simd_f32s(&inputs.padded(place.inputs[*frame] + plane)[from..][..len]).0;
                    }
                    for v in 0..len / S::F32_LANES {
                        let x = [x[0][v], x[1][v], x[2][v]];
                        for (acc, y) in acc.iter_mut().zip(&y) {
                            let y = y[v];
                            for (a, x) in acc.iter_mut().zip(x) {
                                *a = simd.mul_add_e_f32s(y, x, *a);
                            }
                        }
                    }
                }
                for (o, acc) in acc.iter().enumerate() {
                    for (k, a) in acc.iter().enumerate() {
                        let sum = &mut S::as_mut_simd_f32s(&mut sums[k * chunk + (output + o) * LANES..][..LANES]).0[0];
                        *sum = simd.add_f32s(*sum, *a);
                    }
                }
            }
        }
    }
}
