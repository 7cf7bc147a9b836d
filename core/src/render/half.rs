//! Filters in half the memory: numbers of 16 bits beside the largest of their block.
//!
//! Fifty instances do not fit into a core's cache, and most of what they read are filters. A number has a sign, 4 bits of
//! exponent and 11 of fraction, so that it is off by 2^-12 of itself at most, and none is below 2^-15 of its block's largest.

use crate::render::lanes::{Block, EarBlocks, part};
use crate::simd::LANES;
use pulp::{Arch, Simd, WithSimd};

/// Exponent fields of single precision that the least and the largest number of a block have, once the largest is 1 to 2.
const LEAST: u32 = 112 << 23;
const LARGEST: u32 = (128 << 23) - 1;
/// Digits that are lost, and half of the last that is kept.
const LOST: u32 = 12;
const ROUNDING: u32 = 1 << (LOST - 1);
/// Where sign and value of the upper of two numbers are in a word.
const SIGN: u32 = 1 << 31;
const VALUE: u32 = 0x7fff << 16;

/// A filter's block for both ears: of each bin the real part in the lower half of a word, the imaginary part in the upper.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
struct HalfBlocks {
    ears: [[u32; LANES]; 2],
}

/// Filters `[block][hop]`.
pub(crate) struct HalfFilters {
    hops: usize,
    blocks: Vec<HalfBlocks>,
    /// By what the numbers of each are to be multiplied, a power of two; 0 for silence.
    scales: Vec<f32>,
}

/// A number whose magnitude is below 2.
#[inline(always)]
fn halved(value: f32) -> u32 {
    let bits = value.to_bits();
    (((bits & !SIGN) + ROUNDING).clamp(LEAST, LARGEST) - LEAST) >> LOST | (bits & SIGN) >> 16
}

/// The number in the upper half of a word.
#[inline(always)]
fn whole(word: u32) -> f32 {
    f32::from_bits((word & SIGN) | (word & VALUE) >> 4 | LEAST)
}

impl HalfFilters {
    pub(crate) fn new(blocks: usize, hops: usize) -> Self {
        Self { hops, blocks: vec![HalfBlocks::default(); blocks * hops], scales: vec![0.0; blocks * hops] }
    }

    /// Sets a hop of a block.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(&mut self, simd: S, block: usize, hop: usize, filter: &EarBlocks) {
        let mut largest = simd.splat_f32s(0.0);
        for vector in 0..LANES / S::F32_LANES {
            for row in filter.parts::<S>(vector) {
                largest = simd.max_f32s(largest, simd.abs_f32s(row));
            }
        }
        let exponent = simd.reduce_max_f32s(largest).to_bits() >> 23;
        let at = block * self.hops + hop;
        // Fainter than any sound, or no number.
        if !(27..227).contains(&exponent) {
            self.scales[at] = 0.0;
            return;
        }
        self.scales[at] = f32::from_bits(exponent << 23);
        let inverse = f32::from_bits((254 - exponent) << 23);
        for (words, ear) in self.blocks[at].ears.iter_mut().zip(&filter.ears) {
            for (word, (re, im)) in words.iter_mut().zip(ear.re.iter().zip(&ear.im)) {
                *word = halved(inverse * re) | halved(inverse * im) << 16;
            }
        }
    }

    /// A hop of a block.
    pub(crate) fn get(&self, block: usize, hop: usize) -> EarBlocks {
        let at = block * self.hops + hop;
        let scale = self.scales[at];
        EarBlocks {
            ears: self.blocks[at].ears.map(|words| Block {
                re: words.map(|word| scale * whole(word << 16)),
                im: words.map(|word| scale * whole(word)),
            }),
        }
    }

    /// Silences a hop of a block.
    pub(crate) fn silence(&mut self, block: usize, hop: usize) {
        self.scales[block * self.hops + hop] = 0.0;
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.blocks) + size_of_val(&*self.scales)
    }
}

/// Adds `filter[block][tap] * ring[block][slots[tap]]` over taps to both ears, block by block, as
/// [`Accumulate`](crate::render::lanes::Accumulate) does.
pub(crate) struct AccumulateHalf<'a> {
    pub(crate) arch: Arch,
    /// Ring slot of each tap, in the order of the filter's taps.
    pub(crate) slots: &'a [usize],
    /// Slots per block of the ring.
    pub(crate) ring_len: usize,
    pub(crate) ring: &'a [Block],
    /// Filters, of which as many hops as there are slots are applied, from one of them on.
    pub(crate) filter: &'a HalfFilters,
    pub(crate) first: usize,
    pub(crate) sums: &'a mut [EarBlocks],
}

impl AccumulateHalf<'_> {
    pub(crate) fn run(self) {
        self.arch.dispatch(self);
    }
}

/// The upper number of each word of a vector.
#[inline(always)]
fn wholes<S: Simd>(simd: S, words: S::u32s) -> S::f32s {
    let sign = simd.and_u32s(words, simd.splat_u32s(SIGN));
    let value = simd.wrapping_dyn_shr_u32s(simd.and_u32s(words, simd.splat_u32s(VALUE)), simd.splat_u32s(4));
    simd.transmute_f32s_u32s(simd.or_u32s(simd.or_u32s(sign, value), simd.splat_u32s(LEAST)))
}

impl WithSimd for AccumulateHalf<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { slots, ring_len, ring, filter, first, sums, .. } = self;
        let hops = filter.hops;
        if slots.is_empty() {
            return;
        }
        let rows = filter.blocks.chunks_exact(hops).zip(filter.scales.chunks_exact(hops));
        for ((sum, history), (taps, scales)) in sums.iter_mut().zip(ring.chunks_exact(ring_len)).zip(rows) {
            for v in 0..LANES / S::F32_LANES {
                let zero = simd.splat_f32s(0.0);
                let (mut by_re, mut by_im) = ([zero; 4], [zero; 4]);
                for (&slot, (tap, scale)) in slots.iter().zip(taps[first..].iter().zip(&scales[first..])) {
                    let (x, scale) = (&history[slot], simd.splat_f32s(*scale));
                    let re = simd.mul_f32s(scale, part::<S>(&x.re, v));
                    let im = simd.mul_f32s(scale, part::<S>(&x.im, v));
                    for (ear, words) in tap.ears.iter().enumerate() {
                        let words = S::as_simd_u32s(words).0[v];
                        let lower = simd.wrapping_dyn_shl_u32s(words, simd.splat_u32s(16));
                        for (i, h) in [(2 * ear, wholes(simd, lower)), (2 * ear + 1, wholes(simd, words))] {
                            by_re[i] = simd.mul_add_e_f32s(h, re, by_re[i]);
                            by_im[i] = simd.mul_add_e_f32s(h, im, by_im[i]);
                        }
                    }
                }
                let before = sum.parts::<S>(v);
                let mut after = before;
                for (re, im) in [(0, 1), (2, 3)] {
                    after[re] = simd.add_f32s(before[re], simd.sub_f32s(by_re[re], by_im[im]));
                    after[im] = simd.add_f32s(before[im], simd.add_f32s(by_re[im], by_im[re]));
                }
                sum.put_parts::<S>(v, after);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::lanes::Accumulate;
    use crate::simd::tests::arches;

    /// Sets a hop of a block, by the machine's own instructions.
    struct Set<'a>(&'a mut HalfFilters, usize, usize, EarBlocks);

    impl WithSimd for Set<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            self.0.set(simd, self.1, self.2, &self.3);
        }
    }

    fn set(filters: &mut HalfFilters, block: usize, hop: usize, filter: EarBlocks) {
        Arch::new().dispatch(Set(filters, block, hop, filter));
    }

    #[test]
    fn numbers_are_off_by_a_four_thousandth_and_none_is_less_than_a_part_of_the_largest() {
        let mut filters = HalfFilters::new(2, 3);
        for largest in [1e-20_f32, 3e-4, 1.0, 1.999_9, 2.0, 7e9] {
            let mut filter = EarBlocks::default();
            for (i, value) in promenade_testing::noise(3, 4 * LANES).into_iter().enumerate() {
                let block = &mut filter.ears[i / (2 * LANES)];
                let row = if (i / LANES).is_multiple_of(2) { &mut block.re } else { &mut block.im };
                row[i % LANES] = value * largest * 0.5_f32.powi(i as i32 % 24);
            }
            (filter.ears[1].re[3], filter.ears[0].im[5]) = (-largest, 0.0);
            set(&mut filters, 1, 2, filter);
            let found = filters.get(1, 2);
            for (found, wanted) in found.ears.iter().zip(&filter.ears) {
                let found = found.re.iter().chain(&found.im);
                for (found, wanted) in found.zip(wanted.re.iter().chain(&wanted.im)) {
                    let most = (wanted.abs() / 4096.0).max(largest / 16_000.0);
                    assert!((found - wanted).abs() <= most, "{largest}: {found} for {wanted}");
                }
            }
            assert_eq!(filters.get(0, 2), EarBlocks::default(), "others are as they were");
        }
        filters.silence(1, 2);
        assert_eq!(filters.get(1, 2), EarBlocks::default());
        set(&mut filters, 1, 2, EarBlocks { ears: [Block { re: [f32::INFINITY; LANES], im: [0.0; LANES] }; 2] });
        assert_eq!(filters.get(1, 2), EarBlocks::default());
    }

    #[test]
    fn sums_are_those_of_the_whole_numbers() {
        let (blocks, hops) = (3, 5);
        let value = |i: usize| promenade_testing::signal::noise_at(7, i);
        let mut half = HalfFilters::new(blocks, hops);
        let mut filter = vec![EarBlocks::default(); blocks * hops];
        let mut ring = vec![Block::default(); blocks * hops];
        for at in 0..blocks * hops {
            let block = |seed: usize| Block {
                re: std::array::from_fn(|i| value(1_000 * seed + 40 * at + i)),
                im: std::array::from_fn(|i| value(1_000 * seed + 40 * at + 20 + i)),
            };
            set(&mut half, at / hops, at % hops, EarBlocks { ears: [block(1), block(2)] });
            filter[at] = half.get(at / hops, at % hops);
            ring[at] = block(3);
        }
        let slots = [3, 1, 4];
        for arch in arches() {
            let mut sums =
                [(); 2].map(|()| vec![EarBlocks { ears: [Block { re: [0.5; LANES], im: [0.25; LANES] }; 2] }; blocks]);
            let [found, wanted] = &mut sums;
            let (ring_len, ring, filter) = (hops, &ring[..], &filter[..]);
            AccumulateHalf { arch, slots: &slots, ring_len, ring, filter: &half, first: 2, sums: found }.run();
            Accumulate { arch, slots: &slots, ring_len, ring, filter, hops, first: 2, sums: wanted }.run();
            for (found, wanted) in found.iter().flat_map(|s| &s.ears).zip(wanted.iter().flat_map(|s| &s.ears)) {
                let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
                assert!(close(&found.re, &wanted.re) && close(&found.im, &wanted.im));
            }
        }
    }
}
