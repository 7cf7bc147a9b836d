//! The convolution layers over a clip that has one mixture mask and one difference mask for all of its frames.

use crate::network::shapes::CONV_CHANNELS;
use crate::published::conv::layer::{Conv, First, Layer};
use crate::published::conv::{BASE, ConvWeights, DIFFERENCE, HIDDEN, MIX, MIXTURE, NARROW, WIDE, bound};
use crate::published::frames::Frames;
use crate::simd::{for_few, for_tiles};
use pulp::{Arch, Simd, WithSimd};

/// Frames that are kept of what lies between the layers: those that a block of the adjoint reads.
pub(crate) const RING: usize = BLOCK + 6;
/// Frames that the adjoint works on at a time.
pub(crate) const BLOCK: usize = 4;
/// Rows of a frame between the layers, `[ear][channel]`.
pub(crate) const BOTH: usize = 2 * CONV_CHANNELS;
/// Frames that an output frame lies behind the newest input frame, where the input is at hand.
const DELAY: usize = 2;

/// The planes of a clip that change from frame to frame, with zeros before and after.
pub(crate) struct ClipPlanes {
    rows: Frames,
}

impl ClipPlanes {
    /// Of a frame: mix, masked magnitude; masked magnitude times difference mask.
    pub(crate) const COUNT: usize = Self::EVEN + 1;
    /// Planes that both ears have alike.
    pub(crate) const EVEN: usize = 2;

    pub(crate) fn new(frames: usize, bins: usize) -> Self {
        Self { rows: Frames::new((frames + WIDE - 1) * Self::COUNT, bins) }
    }

    pub(crate) fn get(&self, frame: usize, plane: usize) -> &[f32] {
        self.rows.row((frame + WIDE / 2) * Self::COUNT + plane)
    }

    pub(crate) fn get_mut(&mut self, frame: usize, plane: usize) -> &mut [f32] {
        self.rows.row_mut((frame + WIDE / 2) * Self::COUNT + plane)
    }

    /// The masked magnitudes, and those times the difference mask.
    pub(crate) fn pair_mut(&mut self, frame: usize) -> [&mut [f32]; 2] {
        let at = (frame + WIDE / 2) * Self::COUNT + 1;
        self.rows.pair_mut(at, at + 1)
    }

    pub(crate) fn rows(&self) -> &Frames {
        &self.rows
    }

    /// First row of each frame around one.
    #[inline(always)]
    pub(crate) fn around(frame: usize) -> [usize; WIDE] {
        std::array::from_fn(|i| (frame + i) * Self::COUNT)
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.rows.memory_bytes()
    }
}

/// What the layers add to both ears of a clip.
///
/// The masks' planes are the same in all frames: what they contribute to the first layer is computed once for all frames that
/// are not at the clip's ends.
pub(crate) struct ClipConv {
    arch: Arch,
    frames: usize,
    even: Layer,
    odd: Layer,
    /// Of the mixture mask, with the bias, and of the difference mask.
    even_mask: Layer,
    odd_mask: Layer,
    middle: Layer,
    last: Layer,
    /// Zeros, mixture mask, difference mask.
    pub(crate) masks: Frames,
    /// What the masks contribute, `[part][channel]`, and which frames of the kernel it is the sum of.
    constant: Frames,
    reach: Option<[bool; WIDE]>,
    /// `[frame modulo RING][ear][channel]`.
    pub(crate) first: Frames,
    pub(crate) second: Frames,
    out: Frames,
}

impl ClipConv {
    pub(crate) fn new(frames: usize, bins: usize, arch: Arch) -> Self {
        Self {
            arch,
            frames,
            even: Layer::new(CONV_CHANNELS, ClipPlanes::EVEN, WIDE),
            odd: Layer::new(CONV_CHANNELS, 1, WIDE),
            even_mask: Layer::new(CONV_CHANNELS, 1, WIDE),
            odd_mask: Layer::new(CONV_CHANNELS, 1, WIDE),
            middle: Layer::new(CONV_CHANNELS, CONV_CHANNELS, NARROW),
            last: Layer::new(1, CONV_CHANNELS, NARROW),
            masks: Frames::new(3, bins),
            constant: Frames::new(BOTH, bins),
            reach: None,
            first: Frames::new(RING * BOTH, bins),
            second: Frames::new(RING * BOTH, bins),
            out: Frames::new(2, bins),
        }
    }

    /// Starts a clip.
    pub(crate) fn start(&mut self, weights: &ConvWeights, mixture: &[f32], difference: &[f32]) {
        let [first, second, third] = &weights.layers;
        self.even.set(first, &[MIX, BASE]);
        self.odd.set(first, &[BASE]);
        self.even_mask.set(first, &[MIXTURE]);
        self.even_mask.set_bias(first);
        self.odd_mask.set(first, &[DIFFERENCE]);
        for (layer, from) in [(&mut self.middle, second), (&mut self.last, third)] {
            layer.set(from, &HIDDEN);
            layer.set_bias(from);
        }
        self.masks.row_mut(1).copy_from_slice(mixture);
        self.masks.row_mut(2).copy_from_slice(difference);
        self.reach = None;
        [&mut self.first, &mut self.second].into_iter().for_each(Frames::clear);
    }

    /// Takes the next frame, counted from 0, on beyond the last. Gives the frame that [`ClipConv::ear`] then has.
    pub(crate) fn push(&mut self, frame: usize, planes: &ClipPlanes) -> Option<usize> {
        self.arch.dispatch(Push { conv: self, frame, planes });
        frame.checked_sub(DELAY).filter(|f| *f < self.frames)
    }

    /// Frames to push for a clip.
    pub(crate) fn pushes(&self) -> usize {
        self.frames + DELAY
    }

    /// What the layers add to the magnitude of an ear, left 0 or right 1.
    pub(crate) fn ear(&self, ear: usize) -> &[f32] {
        self.out.row(ear)
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let rows = [&self.masks, &self.constant, &self.first, &self.second, &self.out].map(Frames::memory_bytes);
        let layers =
            [&self.even, &self.odd, &self.even_mask, &self.odd_mask, &self.middle, &self.last].map(Layer::memory_bytes);
        rows.iter().chain(&layers).sum()
    }
}

/// Rows of each frame around one in a ring, from one row of a frame on.
#[inline(always)]
pub(crate) fn around<const N: usize>(frame: usize, rows: usize, row: usize) -> [usize; N] {
    std::array::from_fn(|i| (frame + RING + i - N / 2) % RING * rows + row)
}

/// Whether a frame of the first layer's kernel falls into the clip, for an output frame.
#[inline(always)]
pub(crate) fn within(frame: usize, frames: usize, tap: usize) -> bool {
    (WIDE / 2..frames + WIDE / 2).contains(&(frame + tap))
}

struct Push<'a> {
    conv: &'a mut ClipConv,
    frame: usize,
    planes: &'a ClipPlanes,
}

impl WithSimd for Push<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let ClipConv {
            frames, even, odd, even_mask, odd_mask, middle, last, masks, constant, reach, first, second, out, ..
        } = self.conv;
        let (frame, frames, bins) = (self.frame, *frames, masks.len());
        let slot = frame % RING * BOTH;
        if frame < frames {
            let here: [bool; WIDE] = std::array::from_fn(|tap| within(frame, frames, tap));
            if *reach != Some(here) {
                *reach = Some(here);
                for (layer, row, slot) in [(even_mask, 1, 0), (odd_mask, 2, CONV_CHANNELS)] {
                    let slots = here.map(|inside| if inside { row } else { 0 });
                    let mut op = Conv { layer, x: masks, slots, rectify: false, out: constant, slot };
                    for_tiles(simd, CONV_CHANNELS, bins, &mut op);
                }
            }
            let (x, slots) = (self.planes.rows(), ClipPlanes::around(frame));
            let mut op = First { even, odd, constant: Some(constant), x, slots, out: first, slot };
            for_tiles(simd, CONV_CHANNELS, bins, &mut op);
        }
        bound(first, slot, frame < frames);
        if let Some(frame) = frame.checked_sub(1) {
            let slot = frame % RING * BOTH;
            for row in [0, CONV_CHANNELS] {
                if frame < frames {
                    let slots = around::<NARROW>(frame, BOTH, row);
                    let mut op = Conv { layer: middle, x: first, slots, rectify: true, out: second, slot: slot + row };
                    for_tiles(simd, CONV_CHANNELS, bins, &mut op);
                }
            }
            bound(second, slot, frame < frames);
        }
        if let Some(frame) = frame.checked_sub(2).filter(|f| *f < frames) {
            for ear in 0..2 {
                let slots = around::<NARROW>(frame, BOTH, ear * CONV_CHANNELS);
                for_few::<S, 1>(simd, bins, &mut Conv { layer: last, x: second, slots, rectify: false, out, slot: ear });
                out.clear_after(ear);
            }
        }
    }
}
