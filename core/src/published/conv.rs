//! The render head's three convolution layers over frequency and time, one frame at a time.
//!
//! 4 to 16 channels 7 x 7, 16 to 16 3 x 3, 16 to 1 3 x 3, ReLU between them, zeros around a clip, the same weights for both
//! ears. The first layer is linear and its inputs for the two ears are sums and differences of few planes, so it is computed
//! once: the even part plus or minus the odd part.

mod layer;
mod weights;

pub(crate) use weights::{ConvLayerWeights, ConvWeights};

use crate::network::CloudModel;
use crate::network::shapes::CONV_CHANNELS;
use crate::published::frames::Frames;
use crate::simd::{for_few, for_tiles};
use layer::{Conv, First, Layer};
use pulp::{Arch, Simd, WithSimd};

/// Frames that an output frame lies behind the newest input frame: half of the receptive field.
pub(crate) const CONV_DELAY: usize = 5;

/// Bins and frames that the first layer reaches over.
const WIDE: usize = 7;
/// Bins and frames that the other layers reach over.
const NARROW: usize = 3;
/// Planes that both ears have alike: filtered mixture, masked magnitude, mixture mask.
const EVEN: usize = 3;
/// Planes that the ears have with opposite signs: masked magnitude times difference mask, difference mask.
const ODD: usize = 2;
const PLANES: usize = EVEN + ODD;

/// Channels of the published first layer.
const MIX: usize = 0;
const BASE: usize = 1;
const MIXTURE: usize = 2;
const DIFFERENCE: usize = 3;
/// Channels between the layers.
const HIDDEN: [usize; CONV_CHANNELS] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// One frame of what the layers read, one value per bin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planes<'a> {
    /// Output of the time filter.
    pub(crate) mix: &'a [f32],
    /// Source magnitude times the mixture mask.
    pub(crate) masked: &'a [f32],
    pub(crate) mixture: &'a [f32],
    pub(crate) difference: &'a [f32],
}

/// The layers over a stream of frames, whose masks may change from frame to frame.
pub(crate) struct ConvLayers {
    arch: Arch,
    even: Layer,
    odd: Layer,
    middle: Layer,
    last: Layer,
    /// `[frame modulo WIDE][plane]`.
    planes: Frames,
    /// `[frame modulo NARROW][ear][channel]`.
    first: Frames,
    /// `[frame modulo NARROW][ear][channel]`.
    second: Frames,
    out: Frames,
    /// Frames pushed, modulo [`WIDE`] times [`NARROW`].
    frame: usize,
    /// Bit i: whether the frame pushed i frames ago belongs to the clip.
    inside: u32,
}

impl ConvLayers {
    /// `None` if the model has no such layers.
    pub(crate) fn new(model: &CloudModel, bins: usize, arch: Arch) -> Option<Self> {
        Some(Self::from_weights(&ConvWeights::of(model)?, bins, arch))
    }

    /// Those of weights, computed with the given instruction set.
    pub(crate) fn from_weights(ConvWeights { layers: [first, second, third] }: &ConvWeights, bins: usize, arch: Arch) -> Self {
        let mut even = Layer::new(CONV_CHANNELS, EVEN, WIDE);
        even.set(first, &[MIX, BASE, MIXTURE]);
        even.set_bias(first);
        let mut odd = Layer::new(CONV_CHANNELS, ODD, WIDE);
        odd.set(first, &[BASE, DIFFERENCE]);
        let narrow = |outputs, from: &ConvLayerWeights| {
            let mut layer = Layer::new(outputs, CONV_CHANNELS, NARROW);
            layer.set(from, &HIDDEN);
            layer.set_bias(from);
            layer
        };
        Self {
            arch,
            even,
            odd,
            middle: narrow(CONV_CHANNELS, second),
            last: narrow(1, third),
            planes: Frames::new(WIDE * PLANES, bins),
            first: Frames::new(NARROW * 2 * CONV_CHANNELS, bins),
            second: Frames::new(NARROW * 2 * CONV_CHANNELS, bins),
            out: Frames::new(2, bins),
            frame: 0,
            inside: 0,
        }
    }

    /// Takes the next frame, or a frame of zeros outside a clip. Says whether the frame [`CONV_DELAY`] ago, which
    /// [`ConvLayers::ear`] then has, belongs to the clip.
    pub(crate) fn push(&mut self, planes: Option<Planes<'_>>) -> bool {
        self.frame = (self.frame + 1) % (WIDE * NARROW);
        self.inside = self.inside << 1 | u32::from(planes.is_some());
        let slot = self.frame % WIDE * PLANES;
        match planes {
            None => (0..PLANES).for_each(|p| self.planes.row_mut(slot + p).fill(0.0)),
            Some(Planes { mix, masked, mixture, difference }) => {
                for (p, plane) in [(0, mix), (1, masked), (2, mixture), (4, difference)] {
                    self.planes.row_mut(slot + p).copy_from_slice(plane);
                }
                for ((x, s), d) in self.planes.row_mut(slot + 3).iter_mut().zip(masked).zip(difference) {
                    *x = s * d;
                }
            }
        }
        self.arch.dispatch(Push { layers: self });
        self.inside >> CONV_DELAY & 1 == 1
    }

    /// What the layers add to the magnitude of an ear, left 0 or right 1, for the frame [`CONV_DELAY`] ago.
    pub(crate) fn ear(&self, ear: usize) -> &[f32] {
        self.out.row(ear)
    }

    pub(crate) fn reset(&mut self) {
        [&mut self.planes, &mut self.first, &mut self.second, &mut self.out].into_iter().for_each(Frames::clear);
        self.frame = 0;
        self.inside = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        [&self.planes, &self.first, &self.second, &self.out].into_iter().map(Frames::memory_bytes).sum()
    }
}

struct Push<'a> {
    layers: &'a mut ConvLayers,
}

impl WithSimd for Push<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let ConvLayers { even, odd, middle, last, planes, first, second, out, frame, inside, .. } = self.layers;
        let inside = |behind: usize| *inside >> behind & 1 == 1;
        let bins = planes.len();
        // Oldest first.
        let wide: [usize; WIDE] = slots(*frame, PLANES);
        let narrow: [usize; NARROW] = slots(*frame, 2 * CONV_CHANNELS);
        let newest = narrow[NARROW - 1];
        if inside(3) {
            let mut op = First { even, odd, x: planes, slots: wide, out: first, slot: newest };
            for_tiles(simd, CONV_CHANNELS, bins, &mut op);
        }
        bound(first, newest, inside(3));
        for ear in 0..2 {
            let slots = narrow.map(|s| s + ear * CONV_CHANNELS);
            if inside(4) {
                let slot = newest + ear * CONV_CHANNELS;
                let mut op = Conv { layer: middle, x: first, slots, rectify: true, out: second, slot };
                for_tiles(simd, CONV_CHANNELS, bins, &mut op);
            }
        }
        bound(second, newest, inside(4));
        for ear in 0..2 {
            let slots = narrow.map(|s| s + ear * CONV_CHANNELS);
            for_few::<S, 1>(simd, bins, &mut Conv { layer: last, x: second, slots, rectify: false, out, slot: ear });
            out.clear_after(ear);
        }
    }
}

/// Zeros around a hidden frame of both ears: padding is of every layer's input, so a hidden frame outside the clip is zero, not
/// the response to zeros.
#[inline(always)]
fn bound(hidden: &mut Frames, slot: usize, inside: bool) {
    for channel in slot..slot + 2 * CONV_CHANNELS {
        if inside { hidden.clear_after(channel) } else { hidden.row_mut(channel).fill(0.0) }
    }
}

/// First rows of the newest frames in a ring, oldest first.
fn slots<const N: usize>(frame: usize, rows: usize) -> [usize; N] {
    std::array::from_fn(|i| (frame + 1 + i) % N * rows)
}

#[cfg(test)]
pub(crate) mod tests;
