//! The render head's three convolution layers over frequency and time, one frame at a time.

use crate::cloud::CloudModel;
use crate::cloud::model::CONV_CHANNELS;
use crate::cloud::rows::{MARGIN, OUTPUTS, Rows, Tile, for_tiles, step};
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

/// Weights of one layer, `[output / OUTPUTS][plane][frame][bin][OUTPUTS]`.
struct Layer {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

/// 4 to 16 channels 7 x 7, 16 to 16 3 x 3, 16 to 1 3 x 3, ReLU between them, zeros around a clip, the same weights for both ears.
///
/// The first layer is linear and its inputs for the two ears are sums and differences of five planes, so it is computed once:
/// the even part plus or minus the odd part.
pub(crate) struct ConvLayers {
    arch: Arch,
    even: Layer,
    odd: Layer,
    middle: Layer,
    last: Layer,
    /// `[frame modulo WIDE][plane]`.
    planes: Rows,
    /// `[frame modulo NARROW][ear][channel]`.
    first: Rows,
    /// `[frame modulo NARROW][ear][channel]`.
    second: Rows,
    out: Rows,
    /// Frames pushed, modulo [`WIDE`] times [`NARROW`].
    frame: usize,
    /// Bit i: whether the frame pushed i frames ago belongs to the clip.
    inside: u32,
}

impl ConvLayers {
    /// `None` if the model has no such layers.
    pub(crate) fn new(model: &CloudModel, bins: usize, arch: Arch) -> Option<Self> {
        model.sizes().conv.then(|| Self::from_weights(|name| model.weights(name), bins, arch))
    }

    fn from_weights<'a>(weights: impl Fn(&str) -> &'a [f32], bins: usize, arch: Arch) -> Self {
        let layer = |name: &str, size: usize, channels: &[usize]| {
            Layer::new(weights(&format!("{name}.weight")), weights(&format!("{name}.bias")), size, channels)
        };
        // Channels of the published first layer: filtered mixture, base, mixture mask, signed difference mask.
        let even = layer("out.0", WIDE, &[0, 1, 2]);
        let mut odd = layer("out.0", WIDE, &[1, 3]);
        odd.bias.fill(0.0);
        let channels: Vec<usize> = (0..CONV_CHANNELS).collect();
        Self {
            arch,
            even,
            odd,
            middle: layer("out.2", NARROW, &channels),
            last: layer("out.4", NARROW, &channels),
            planes: Rows::new(WIDE * PLANES, bins),
            first: Rows::new(NARROW * 2 * CONV_CHANNELS, bins),
            second: Rows::new(NARROW * 2 * CONV_CHANNELS, bins),
            out: Rows::new(2, bins),
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
        [&mut self.planes, &mut self.first, &mut self.second, &mut self.out].into_iter().for_each(Rows::clear);
        self.frame = 0;
        self.inside = 0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        [&self.planes, &self.first, &self.second, &self.out].into_iter().map(Rows::memory_bytes).sum()
    }
}

impl Layer {
    /// From weights `[output][channel][bin][frame]`, of which some channels are taken.
    fn new(published: &[f32], bias: &[f32], size: usize, channels: &[usize]) -> Self {
        let (outputs, inputs) = (bias.len(), published.len() / (bias.len() * size * size));
        let mut weights = Vec::with_capacity(outputs.next_multiple_of(OUTPUTS) * channels.len() * size * size);
        for tile in (0..outputs).step_by(OUTPUTS) {
            for channel in channels {
                for frame in 0..size {
                    for bin in 0..size {
                        let at = |o: usize| ((o * inputs + channel) * size + bin) * size + frame;
                        weights.extend((tile..tile + OUTPUTS).map(|o| if o < outputs { published[at(o)] } else { 0.0 }));
                    }
                }
            }
        }
        Self { weights, bias: bias.to_vec() }
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
            for_tiles(simd, CONV_CHANNELS, bins, &mut First { even, odd, x: planes, slots: wide, out: first, slot: newest });
        }
        bound(first, newest, inside(3));
        for ear in 0..2 {
            let slots = narrow.map(|s| s + ear * CONV_CHANNELS);
            if inside(4) {
                let slot = newest + ear * CONV_CHANNELS;
                for_tiles(simd, CONV_CHANNELS, bins, &mut Middle { layer: middle, x: first, slots, out: second, slot });
            }
        }
        bound(second, newest, inside(4));
        for ear in 0..2 {
            let slots = narrow.map(|s| s + ear * CONV_CHANNELS);
            let mut op = Last { layer: last, x: second, slots, out, slot: ear };
            let vectors = bins.div_ceil(S::F32_LANES);
            let eights = vectors / 8;
            (0..eights).for_each(|i| op.tile::<S, 1, 8>(simd, 0, 8 * i * S::F32_LANES));
            (8 * eights..vectors).for_each(|i| op.tile::<S, 1, 1>(simd, 0, i * S::F32_LANES));
            out.clear_after(ear);
        }
    }
}

/// Zeros around a hidden frame: padding is of every layer's input, so a hidden frame outside the clip is zero, not the response to
/// zeros.
fn bound(hidden: &mut Rows, slot: usize, inside: bool) {
    for channel in slot..slot + 2 * CONV_CHANNELS {
        if inside { hidden.clear_after(channel) } else { hidden.row_mut(channel).fill(0.0) }
    }
}

/// First rows of the newest frames in a ring, oldest first.
fn slots<const N: usize>(frame: usize, rows: usize) -> [usize; N] {
    std::array::from_fn(|i| (frame + 1 + i) % N * rows)
}

/// Adds a layer's weighted planes to the sums of a tile.
#[inline(always)]
fn convolve<S: Simd, const O: usize, const V: usize, const SIZE: usize>(
    simd: S,
    acc: &mut [[S::f32s; V]; O],
    (layer, planes, output): (&Layer, usize, usize),
    (x, slots, position): (&Rows, &[usize; SIZE], usize),
) {
    let len = planes * SIZE * SIZE * OUTPUTS;
    let weights = &layer.weights[output / OUTPUTS * len..][..len];
    let within = output % OUTPUTS;
    let start = MARGIN + position - SIZE / 2;
    for (plane, weights) in weights.chunks_exact(SIZE * SIZE * OUTPUTS).enumerate() {
        for (slot, weights) in slots.iter().zip(weights.chunks_exact(SIZE * OUTPUTS)) {
            let x = &x.padded(slot + plane)[start..][..V * S::F32_LANES + SIZE - 1];
            for (bin, w) in weights.as_chunks::<OUTPUTS>().0.iter().enumerate() {
                step(simd, acc, &w[within..][..O], &x[bin..][..V * S::F32_LANES]);
            }
        }
    }
}

#[inline(always)]
fn bias<S: Simd, const O: usize, const V: usize>(simd: S, layer: &Layer, output: usize) -> [[S::f32s; V]; O] {
    let mut acc = [[simd.splat_f32s(0.0); V]; O];
    for (acc, b) in acc.iter_mut().zip(&layer.bias[output..]) {
        acc.fill(simd.splat_f32s(*b));
    }
    acc
}

struct First<'a> {
    even: &'a Layer,
    odd: &'a Layer,
    x: &'a Rows,
    slots: [usize; WIDE],
    out: &'a mut Rows,
    slot: usize,
}

impl Tile for First<'_> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let mut even = bias::<S, O, V>(simd, self.even, output);
        convolve(simd, &mut even, (self.even, EVEN, output), (self.x, &self.slots, position));
        let mut odd = [[simd.splat_f32s(0.0); V]; O];
        let odd_slots = self.slots.map(|s| s + EVEN);
        convolve(simd, &mut odd, (self.odd, ODD, output), (self.x, &odd_slots, position));
        let zero = simd.splat_f32s(0.0);
        for o in 0..O {
            for ear in 0..2 {
                let row = self.out.padded_mut(self.slot + ear * CONV_CHANNELS + output + o);
                let row = S::as_mut_simd_f32s(&mut row[MARGIN + position..][..V * S::F32_LANES]).0;
                for ((r, e), d) in row.iter_mut().zip(&even[o]).zip(&odd[o]) {
                    let sum = if ear == 0 { simd.sub_f32s(*e, *d) } else { simd.add_f32s(*e, *d) };
                    *r = simd.max_f32s(sum, zero);
                }
            }
        }
    }
}

struct Middle<'a> {
    layer: &'a Layer,
    x: &'a Rows,
    slots: [usize; NARROW],
    out: &'a mut Rows,
    slot: usize,
}

impl Tile for Middle<'_> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let mut acc = bias::<S, O, V>(simd, self.layer, output);
        convolve(simd, &mut acc, (self.layer, CONV_CHANNELS, output), (self.x, &self.slots, position));
        let zero = simd.splat_f32s(0.0);
        for (o, acc) in acc.iter().enumerate() {
            let row = &mut self.out.padded_mut(self.slot + output + o)[MARGIN + position..][..V * S::F32_LANES];
            for (r, a) in S::as_mut_simd_f32s(row).0.iter_mut().zip(acc) {
                *r = simd.max_f32s(*a, zero);
            }
        }
    }
}

struct Last<'a> {
    layer: &'a Layer,
    x: &'a Rows,
    slots: [usize; NARROW],
    out: &'a mut Rows,
    slot: usize,
}

impl Tile for Last<'_> {
    #[inline(always)]
    fn tile<S: Simd, const O: usize, const V: usize>(&mut self, simd: S, output: usize, position: usize) {
        let mut acc = bias::<S, O, V>(simd, self.layer, output);
        convolve(simd, &mut acc, (self.layer, CONV_CHANNELS, output), (self.x, &self.slots, position));
        let row = &mut self.out.padded_mut(self.slot)[MARGIN + position..][..V * S::F32_LANES];
        for (r, a) in S::as_mut_simd_f32s(row).0.iter_mut().zip(&acc[0]) {
            *r = *a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::rows::tests::{arches, noise};
    use std::collections::BTreeMap;

    /// A channel by time and bin.
    type Image = Vec<Vec<f32>>;

    fn naive(x: &[Image], (weights, bias): (&[f32], &[f32]), size: usize, relu: bool) -> Vec<Image> {
        let (frames, bins) = (x[0].len(), x[0][0].len());
        let half = size / 2;
        let at = |c: usize, t: usize, f: usize| {
            let inside = (half..frames + half).contains(&t) && (half..bins + half).contains(&f);
            if inside { x[c][t - half][f - half] } else { 0.0 }
        };
        let sum = |o: usize, t: usize, f: usize| {
            let mut sum = f64::from(bias[o]);
            for c in 0..x.len() {
                for kf in 0..size {
                    for kt in 0..size {
                        let w = weights[((o * x.len() + c) * size + kf) * size + kt];
                        sum += f64::from(w) * f64::from(at(c, t + kt, f + kf));
                    }
                }
            }
            if relu { sum.max(0.0) as f32 } else { sum as f32 }
        };
        (0..bias.len()).map(|o| (0..frames).map(|t| (0..bins).map(|f| sum(o, t, f)).collect()).collect()).collect()
    }

    #[test]
    fn frame_by_frame_equals_the_three_layers_over_a_whole_clip() {
        let mut weights: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
        let mut tensor = |name: &'static str, len: usize, scale: f32, seed: u32| {
            weights.insert(name, (0..len).map(|i| scale * noise(seed, i)).collect());
        };
        tensor("out.0.weight", 16 * 4 * 49, 0.07, 1);
        tensor("out.0.bias", 16, 0.2, 2);
        tensor("out.2.weight", 16 * 16 * 9, 0.1, 3);
        tensor("out.2.bias", 16, 0.2, 4);
        tensor("out.4.weight", 16 * 9, 0.1, 5);
        tensor("out.4.bias", 1, 0.2, 6);
        for (bins, frames) in [(53, 13), (8, 1), (33, 4), (257, 2)] {
            let plane =
                |seed| -> Image { (0..frames).map(|t| (0..bins).map(|f| noise(seed, t * bins + f)).collect()).collect() };
            let planes = [plane(11), plane(12), plane(13), plane(14)];
            let [mix, masked, mixture, difference] = &planes;
            let wanted = [-1.0, 1.0].map(|sign| {
                let map = |f: &dyn Fn(usize, usize) -> f32| -> Image {
                    (0..frames).map(|t| (0..bins).map(|b| f(t, b)).collect()).collect()
                };
                let base = map(&|t, f| (1.0 + sign * difference[t][f]) * masked[t][f]);
                let signed = map(&|t, f| sign * difference[t][f]);
                let x = [mix.clone(), base, mixture.clone(), signed];
                let hidden = naive(&x, (&weights["out.0.weight"], &weights["out.0.bias"]), 7, true);
                let hidden = naive(&hidden, (&weights["out.2.weight"], &weights["out.2.bias"]), 3, true);
                naive(&hidden, (&weights["out.4.weight"], &weights["out.4.bias"]), 3, false).remove(0)
            });
            for arch in arches() {
                let mut layers = ConvLayers::from_weights(|name| &weights[name], bins, arch);
                // A second clip after the first finds nothing of it.
                for clip in 0..2 {
                    for p in 0..frames + CONV_DELAY {
                        let at = |i: usize| &planes[i][p][..];
                        let inside = layers.push((p < frames).then(|| Planes {
                            mix: at(0),
                            masked: at(1),
                            mixture: at(2),
                            difference: at(3),
                        }));
                        assert_eq!(inside, p >= CONV_DELAY);
                        for ear in (0..2).filter(|_| inside) {
                            for (a, b) in layers.ear(ear).iter().zip(&wanted[ear][p - CONV_DELAY]) {
                                assert!((a - b).abs() < 1e-5, "{arch:?}, clip {clip}, frame {p}: {a} for {b}");
                            }
                        }
                    }
                    layers.reset();
                }
            }
        }
    }
}
