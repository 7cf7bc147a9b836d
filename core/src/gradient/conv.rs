//! The derivative of what the convolution layers add to a clip, by their weights and by all that they read.

use crate::gradient::correlation::{Correlation, Place, Tap};
use crate::network::shapes::CONV_CHANNELS;
use crate::published::conv::clip::{BLOCK, BOTH, RING, around, within};
use crate::published::conv::layer::{Conv, Layer};
use crate::published::conv::{
    BASE, ClipConv, ClipPlanes, ConvLayerWeights, ConvWeights, DIFFERENCE, HIDDEN, MIX, MIXTURE, NARROW, WIDE, bound,
};
use crate::published::frames::Frames;
use crate::simd::{for_few, for_tiles};
use pulp::{Arch, Simd, WithSimd};

/// Follows a [`ClipConv`] a few frames behind and carries derivatives back through it. Between the layers nothing but the
/// frames that are still read is kept.
pub(crate) struct ConvAdjoint {
    arch: Arch,
    frames: usize,
    by_last: Layer,
    by_middle: Layer,
    by_even: Layer,
    by_odd: Layer,
    by_even_mask: Layer,
    by_odd_mask: Layer,
    /// Derivatives by the layers' output, `[frame modulo RING][ear]`.
    out: Frames,
    /// By the sums of the second layer, `[frame modulo RING][ear][channel]`.
    second: Frames,
    /// By the even and the odd part of the first layer's, `[frame modulo RING][part][channel]`.
    first: Frames,
    /// By the planes, `[frame][plane]`.
    planes: Frames,
    /// By the masks as planes: mixture, difference.
    masks: Frames,
    out_sum: Frames,
    /// `[channel]`.
    second_sum: Frames,
    /// `[frame of the kernel][part][channel]`, of those frames for which the kernel's frame falls into the clip.
    first_sums: Frames,
    by_first_even: Correlation<WIDE>,
    by_first_odd: Correlation<WIDE>,
    by_first_masks: Correlation<WIDE>,
    by_second: Correlation<NARROW>,
    by_third: Correlation<NARROW>,
}

impl ConvAdjoint {
    pub(crate) fn new(frames: usize, bins: usize, arch: Arch) -> Self {
        let one_frame = (0..WIDE).map(|bin| Tap { frame: 0, plane: 0, bin }).collect();
        Self {
            arch,
            frames,
            by_last: Layer::new(CONV_CHANNELS, 1, NARROW),
            by_middle: Layer::new(CONV_CHANNELS, CONV_CHANNELS, NARROW),
            by_even: Layer::new(ClipPlanes::EVEN, CONV_CHANNELS, WIDE),
            by_odd: Layer::new(1, CONV_CHANNELS, WIDE),
            by_even_mask: Layer::new(1, CONV_CHANNELS, WIDE),
            by_odd_mask: Layer::new(1, CONV_CHANNELS, WIDE),
            out: Frames::new(RING * 2, bins),
            second: Frames::new(RING * BOTH, bins),
            first: Frames::new(RING * BOTH, bins),
            planes: Frames::new(frames * ClipPlanes::COUNT, bins),
            masks: Frames::new(2, bins),
            out_sum: Frames::new(1, bins),
            second_sum: Frames::new(CONV_CHANNELS, bins),
            first_sums: Frames::new(WIDE * BOTH, bins),
            by_first_even: Correlation::new(CONV_CHANNELS, ClipPlanes::EVEN),
            by_first_odd: Correlation::new(CONV_CHANNELS, 1),
            by_first_masks: Correlation::with_taps(CONV_CHANNELS, one_frame),
            by_second: Correlation::new(CONV_CHANNELS, CONV_CHANNELS),
            by_third: Correlation::new(CONV_CHANNELS, 1),
        }
    }

    /// Starts a clip.
    pub(crate) fn start(&mut self, weights: &ConvWeights) {
        let [first, second, third] = &weights.layers;
        set_adjoint(&mut self.by_even, first, WIDE, &[MIX, BASE]);
        set_adjoint(&mut self.by_odd, first, WIDE, &[BASE]);
        set_adjoint(&mut self.by_even_mask, first, WIDE, &[MIXTURE]);
        set_adjoint(&mut self.by_odd_mask, first, WIDE, &[DIFFERENCE]);
        set_adjoint(&mut self.by_middle, second, NARROW, &HIDDEN);
        set_adjoint(&mut self.by_last, third, NARROW, &HIDDEN);
        let rows = [&mut self.out, &mut self.second, &mut self.first];
        let sums = [&mut self.out_sum, &mut self.second_sum, &mut self.first_sums];
        rows.into_iter().chain(sums).for_each(Frames::clear);
        [&mut self.by_first_even, &mut self.by_first_odd].into_iter().for_each(Correlation::clear);
        [&mut self.by_second, &mut self.by_third].into_iter().for_each(Correlation::clear);
    }

    /// Frames that a [`ClipConv`] is to be pushed, [`ConvAdjoint::follow`] called after each.
    pub(crate) fn pushes(&self) -> usize {
        (self.frames + 5).next_multiple_of(BLOCK) + 2
    }

    /// The derivative by what the layers add to an ear's magnitude: to be set for each frame that a push gives.
    pub(crate) fn out_mut(&mut self, frame: usize, ear: usize) -> &mut [f32] {
        self.out.row_mut(frame % RING * 2 + ear)
    }

    /// Follows the push of a frame.
    pub(crate) fn follow(&mut self, conv: &ClipConv, frame: usize, planes: &ClipPlanes) {
        if let Some(end) = frame.checked_sub(1).filter(|end| *end > 0 && end.is_multiple_of(BLOCK)) {
            self.arch.dispatch(Block { adjoint: self, conv, planes, end });
        }
    }

    /// Ends a clip: adds the derivatives by the weights.
    pub(crate) fn finish(&mut self, conv: &ClipConv, by: &mut ConvWeights) {
        self.arch.dispatch(Finish { adjoint: self, conv, by });
    }

    /// The derivative by a plane of [`ClipPlanes`], after [`ConvAdjoint::finish`].
    pub(crate) fn by_plane(&self, frame: usize, plane: usize) -> &[f32] {
        self.planes.row(frame * ClipPlanes::COUNT + plane)
    }

    /// The derivatives by the mixture and the difference mask as the layers' inputs, after [`ConvAdjoint::finish`].
    pub(crate) fn by_masks(&self) -> [&[f32]; 2] {
        [0, 1].map(|mask| self.masks.row(mask))
    }
}

/// What can be carried back once the derivatives by the output are known up to the frame `end`.
struct Block<'a> {
    adjoint: &'a mut ConvAdjoint,
    conv: &'a ClipConv,
    planes: &'a ClipPlanes,
    end: usize,
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (a, conv) = (self.adjoint, self.conv);
        let (frames, bins) = (a.frames, a.out.len());
        let block = |behind: usize| self.end.saturating_sub(behind + BLOCK)..self.end.saturating_sub(behind);
        for frame in block(0) {
            for ear in 0..2 {
                let row = frame % RING * 2 + ear;
                if frame < frames { add_row(&mut a.out_sum, 0, a.out.row(row)) } else { a.out.row_mut(row).fill(0.0) }
            }
        }
        for frame in block(1) {
            let slot = frame % RING * BOTH;
            for ear in (0..2).filter(|_| frame < frames) {
                let (slots, slot) = (around(frame, 2, ear), slot + ear * CONV_CHANNELS);
                let out = &mut a.second;
                let mut op = Conv::<NARROW> { layer: &a.by_last, x: &a.out, slots, rectify: false, out, slot };
                for_tiles(simd, CONV_CHANNELS, bins, &mut op);
                gate_channels(&mut a.second, &conv.second, slot);
            }
            bound(&mut a.second, slot, frame < frames);
            for row in 0..if frame < frames { BOTH } else { 0 } {
                add_row(&mut a.second_sum, row % CONV_CHANNELS, a.second.row(slot + row));
            }
        }
        let mut places = Places::default();
        for row in [0, CONV_CHANNELS] {
            // The hidden frames are the sums' many rows, the derivatives the few that are moved along them.
            let of = |frame| Place { output: frame % RING * BOTH + row, inputs: around(frame, 2, row / CONV_CHANNELS) };
            a.by_third.add(simd, &conv.second, &a.out, places.of(block(1), frames, of));
        }
        for frame in block(2) {
            let slot = frame % RING * BOTH;
            for ear in (0..2).filter(|_| frame < frames) {
                let row = ear * CONV_CHANNELS;
                let (slots, slot) = (around(frame, BOTH, row), slot + row);
                let out = &mut a.first;
                let mut op = Conv::<NARROW> { layer: &a.by_middle, x: &a.second, slots, rectify: false, out, slot };
                for_tiles(simd, CONV_CHANNELS, bins, &mut op);
                gate_channels(&mut a.first, &conv.first, slot);
            }
            bound(&mut a.first, slot, frame < frames);
            if frame < frames {
                parts(&mut a.first, slot);
                sum_parts(&a.first, slot, frame, frames, &mut a.first_sums);
            }
        }
        for row in [0, CONV_CHANNELS] {
            let of = |frame| Place { output: frame % RING * BOTH + row, inputs: around(frame, BOTH, row) };
            a.by_second.add(simd, &a.second, &conv.first, places.of(block(2), frames, of));
        }
        let mut places = Places::default();
        let planes = self.planes.rows();
        let of = |frame| Place { output: frame % RING * BOTH, inputs: ClipPlanes::around(frame) };
        a.by_first_even.add(simd, &a.first, planes, places.of(block(2), frames, of));
        let of = |frame| Place {
            output: frame % RING * BOTH + CONV_CHANNELS,
            inputs: ClipPlanes::around(frame).map(|row| row + ClipPlanes::EVEN),
        };
        a.by_first_odd.add(simd, &a.first, planes, places.of(block(2), frames, of));
        for frame in block(5).filter(|f| *f < frames) {
            let slot = frame * ClipPlanes::COUNT;
            let (x, out) = (&a.first, &mut a.planes);
            let slots = around::<WIDE>(frame, BOTH, 0);
            for_few::<S, 2>(simd, bins, &mut Conv { layer: &a.by_even, x, slots, rectify: false, out, slot });
            let (slots, slot) = (around::<WIDE>(frame, BOTH, CONV_CHANNELS), slot + ClipPlanes::EVEN);
            for_few::<S, 1>(simd, bins, &mut Conv { layer: &a.by_odd, x, slots, rectify: false, out, slot });
        }
    }
}

/// Places of a block's frames.
struct Places<const SIZE: usize>([Place<SIZE>; BLOCK]);

impl<const SIZE: usize> Default for Places<SIZE> {
    fn default() -> Self {
        Self([Place { output: 0, inputs: [0; SIZE] }; BLOCK])
    }
}

impl<const SIZE: usize> Places<SIZE> {
    #[inline(always)]
    fn of(&mut self, block: std::ops::Range<usize>, frames: usize, place: impl Fn(usize) -> Place<SIZE>) -> &[Place<SIZE>] {
        let inside = block.start..block.end.min(frames);
        let count = inside.len();
        self.0.iter_mut().zip(inside).for_each(|(p, frame)| *p = place(frame));
        &self.0[..count]
    }
}

/// Sets the weights of a layer that carries back the derivatives by the outputs of a published layer to these channels of its
/// inputs: outputs and channels change places, frames and bins run backwards.
fn set_adjoint(layer: &mut Layer, of: &ConvLayerWeights, size: usize, channels: &[usize]) {
    let inputs = of.inputs(size);
    layer.fill(|o, plane, frame, bin| {
        of.weight[((plane * inputs + channels[o]) * size + (size - 1 - bin)) * size + (size - 1 - frame)]
    });
}

/// Derivatives by rectified values become those by what was rectified: 0 where the rectified value is.
#[inline(always)]
pub(super) fn gate(by: &mut [f32], rectified: &[f32]) {
    by.iter_mut().zip(rectified).for_each(|(b, r)| *b = if *r > 0.0 { *b } else { 0.0 });
}

#[inline(always)]
fn gate_channels(by: &mut Frames, rectified: &Frames, slot: usize) {
    (slot..slot + CONV_CHANNELS).for_each(|row| gate(by.row_mut(row), rectified.row(row)));
}

#[inline(always)]
fn add_row(sums: &mut Frames, row: usize, x: &[f32]) {
    sums.row_mut(row).iter_mut().zip(x).for_each(|(s, x)| *s += x);
}

/// Derivatives by the left and the right ear become those by the even and the odd part.
#[inline(always)]
fn parts(first: &mut Frames, slot: usize) {
    for channel in slot..slot + CONV_CHANNELS {
        let [left, right] = first.pair_mut(channel, channel + CONV_CHANNELS);
        for (l, r) in left.iter_mut().zip(right) {
            (*l, *r) = (*l + *r, *r - *l);
        }
    }
}

/// Adds a frame to the sum of all, that of the kernel's middle frame, and takes it from those that it does not belong to.
#[inline(always)]
fn sum_parts(first: &Frames, slot: usize, frame: usize, frames: usize, sums: &mut Frames) {
    for row in 0..BOTH {
        let x = first.row(slot + row);
        add_row(sums, WIDE / 2 * BOTH + row, x);
        for tap in (0..WIDE).filter(|tap| !within(frame, frames, *tap)) {
            sums.row_mut(tap * BOTH + row).iter_mut().zip(x).for_each(|(s, x)| *s -= x);
        }
    }
}

struct Finish<'a> {
    adjoint: &'a mut ConvAdjoint,
    conv: &'a ClipConv,
    by: &'a mut ConvWeights,
}

impl WithSimd for Finish<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (a, [first, second, third]) = (self.adjoint, &mut self.by.layers);
        for tap in (0..WIDE).filter(|tap| *tap != WIDE / 2) {
            for row in 0..BOTH {
                let [sum, all] = a.first_sums.pair_mut(tap * BOTH + row, WIDE / 2 * BOTH + row);
                sum.iter_mut().zip(all).for_each(|(s, x)| *s += *x);
            }
        }
        for (part, layer) in [&a.by_even_mask, &a.by_odd_mask].into_iter().enumerate() {
            let slots: [usize; WIDE] = std::array::from_fn(|i| (WIDE - 1 - i) * BOTH + part * CONV_CHANNELS);
            let (x, out) = (&a.first_sums, &mut a.masks);
            for_few::<S, 1>(simd, a.out.len(), &mut Conv { layer, x, slots, rectify: false, out, slot: part });
        }
        let mut add_first = |output, channel, frame, bin, value| {
            first.weight[((output * 4 + channel) * WIDE + bin) * WIDE + frame] += value;
        };
        for part in 0..2 {
            for frame in 0..WIDE {
                a.by_first_masks.clear();
                let place = Place { output: frame * BOTH + part * CONV_CHANNELS, inputs: [1 + part; WIDE] };
                a.by_first_masks.add(simd, &a.first_sums, &self.conv.masks, &[place]);
                for (output, bin) in (0..CONV_CHANNELS * WIDE).map(|i| (i / WIDE, i % WIDE)) {
                    let channel = [MIXTURE, DIFFERENCE][part];
                    add_first(output, channel, frame, bin, a.by_first_masks.sum(output, bin));
                }
            }
        }
        let place = |i: usize| (i / (WIDE * WIDE), i / WIDE % WIDE, i % WIDE);
        for output in 0..CONV_CHANNELS {
            for tap in 0..WIDE * WIDE {
                let (_, frame, bin) = place(tap);
                add_first(output, MIX, frame, bin, a.by_first_even.sum(output, tap));
                let base = a.by_first_even.sum(output, WIDE * WIDE + tap) + a.by_first_odd.sum(output, tap);
                add_first(output, BASE, frame, bin, base);
            }
            first.bias[output] += a.first_sums.row(WIDE / 2 * BOTH + output).iter().sum::<f32>();
            second.bias[output] += a.second_sum.row(output).iter().sum::<f32>();
        }
        third.bias[0] += a.out_sum.row(0).iter().sum::<f32>();
        for (channel, frame, bin) in (0..CONV_CHANNELS * NARROW * NARROW).map(|i| (i / 9, i / NARROW % NARROW, i % NARROW)) {
            let tap = (channel * NARROW + frame) * NARROW + bin;
            let at = (channel * NARROW + bin) * NARROW + frame;
            for output in 0..CONV_CHANNELS {
                second.weight[output * CONV_CHANNELS * NARROW * NARROW + at] += a.by_second.sum(output, tap);
            }
            let moved = (NARROW - 1 - frame) * NARROW + NARROW - 1 - bin;
            third.weight[at] += a.by_third.sum(channel, moved);
        }
    }
}
