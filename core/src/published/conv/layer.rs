//! One convolution layer over bins and frames, and the sums that it takes of rows of bins.

use crate::published::conv::ConvLayerWeights;
use crate::published::frames::{Frames, MARGIN};
use crate::simd::{TILE, Tile, Weights, step};
use pulp::Simd;

/// Weights of one layer; their inputs are `[plane][frame][bin]`.
pub(crate) struct Layer {
    weights: Weights,
    planes: usize,
    size: usize,
}

impl Layer {
    /// Zeros, for kernels of `size` bins by `size` frames.
    pub(crate) fn new(outputs: usize, planes: usize, size: usize) -> Self {
        Self { weights: Weights::new(planes * size * size, outputs, |_, _| 0.0), planes, size }
    }

    /// Takes some channels of a published layer.
    pub(crate) fn set(&mut self, from: &ConvLayerWeights, channels: &[usize]) {
        let (inputs, size) = (from.inputs(self.size), self.size);
        self.weights.set(|input, output| {
            let (plane, frame, bin) = (input / (size * size), input / size % size, input % size);
            from.weight[((output * inputs + channels[plane]) * size + bin) * size + frame]
        });
    }

    /// Takes a published layer's bias.
    pub(crate) fn set_bias(&mut self, from: &ConvLayerWeights) {
        self.weights.set_bias(&from.bias);
    }

    /// The bias of a tile's outputs.
    #[inline(always)]
    fn start<S: Simd, const O: usize, const V: usize>(&self, simd: S, output: usize) -> [[S::f32s; V]; O] {
        let mut acc = [[simd.splat_f32s(0.0); V]; O];
        for (acc, b) in acc.iter_mut().zip(&self.weights.bias()[output / TILE][output % TILE..]) {
            acc.fill(simd.splat_f32s(*b));
        }
        acc
    }

    /// Adds weighted planes to the sums of a tile. The planes of a frame lie side by side; `slots` are the first of each frame.
    #[inline(always)]
    fn convolve<S: Simd, const O: usize, const V: usize, const SIZE: usize>(
        &self,
        simd: S,
        acc: &mut [[S::f32s; V]; O],
        (x, slots): (&Frames, &[usize; SIZE]),
        output: usize,
        position: usize,
    ) {
        let weights = self.weights.tile(output / TILE);
        let within = output % TILE;
        let start = MARGIN + position - SIZE / 2;
        for (plane, weights) in weights.chunks_exact(SIZE * SIZE).enumerate() {
            for (slot, weights) in slots.iter().zip(weights.chunks_exact(SIZE)) {
                let x = &x.padded(slot + plane)[start..][..V * S::F32_LANES + SIZE - 1];
                for (bin, w) in weights.iter().enumerate() {
                    step(simd, acc, &w[within..][..O], &x[bin..][..V * S::F32_LANES]);
                }
            }
        }
    }
}

/// A layer's outputs of one frame.
pub(crate) struct Conv<'a, const SIZE: usize> {
    pub(crate) layer: &'a Layer,
    pub(crate) x: &'a Frames,
    /// First row of each frame that is read.
    pub(crate) slots: [usize; SIZE],
    /// Whether outputs below 0 become 0.
    pub(crate) rectify: bool,
    pub(crate) out: &'a mut Frames,
    /// Row of the first output.
    pub(crate) slot: usize,
}

impl<const SIZE: usize> Tile for Conv<'_, SIZE> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let mut acc = self.layer.start::<S, O, V>(simd, output);
        self.layer.convolve(simd, &mut acc, (self.x, &self.slots), output, position);
        let zero = simd.splat_f32s(0.0);
        for (o, acc) in acc.iter_mut().enumerate() {
            if self.rectify {
                for a in acc.iter_mut() {
                    *a = simd.max_f32s(*a, zero);
                }
            }
            let row = &mut self.out.padded_mut(self.slot + output + o)[MARGIN + position..][..V * S::F32_LANES];
            S::as_mut_simd_f32s(row).0.copy_from_slice(acc);
        }
    }
}

/// The first layer's outputs of one frame for both ears, rectified: `even - odd` left, `even + odd` right. Planes of the even
/// part come before those of the odd part.
pub(crate) struct First<'a, const SIZE: usize> {
    pub(crate) even: &'a Layer,
    pub(crate) odd: &'a Layer,
    pub(crate) x: &'a Frames,
    pub(crate) slots: [usize; SIZE],
    /// `[ear][output]` from the row `slot` on.
    pub(crate) out: &'a mut Frames,
    pub(crate) slot: usize,
}

impl<const SIZE: usize> Tile for First<'_, SIZE> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let outputs = self.even.weights.outputs();
        let mut even = self.even.start::<S, O, V>(simd, output);
        self.even.convolve(simd, &mut even, (self.x, &self.slots), output, position);
        let mut odd = self.odd.start::<S, O, V>(simd, output);
        let odd_slots = self.slots.map(|s| s + self.even.planes);
        self.odd.convolve(simd, &mut odd, (self.x, &odd_slots), output, position);
        let zero = simd.splat_f32s(0.0);
        for o in 0..O {
            for ear in 0..2 {
                let row = self.out.padded_mut(self.slot + ear * outputs + output + o);
                let row = S::as_mut_simd_f32s(&mut row[MARGIN + position..][..V * S::F32_LANES]).0;
                for ((r, e), d) in row.iter_mut().zip(&even[o]).zip(&odd[o]) {
                    let sum = if ear == 0 { simd.sub_f32s(*e, *d) } else { simd.add_f32s(*e, *d) };
                    *r = simd.max_f32s(sum, zero);
                }
            }
        }
    }
}
