//! Time filters: carriers, mixed and coloured by gains per band.

use crate::bands::BandPlace;
use crate::render::carrier::set::CarrierSet;
use crate::render::transform::lanes::{Block, EarBlocks, LANES, blocks_for, part};
use crate::render::transform::ring::{Slot, SlotMut};
use crate::simd::{times, times_plus};
use crate::transfer::MOST_SHARES;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// A run of hops, each a mix of carriers per ear times a gain per bin.
pub(crate) struct Taps {
    arch: Arch,
    hops: usize,
    hats: Hats,
    filters: Vec<EarBlocks>,
}

/// How much each band's gain weighs at each bin: a hat from its lower neighbour to its upper.
struct Hats {
    /// Of each block, the bands that reach into it and where their weights begin.
    blocks: Vec<(Range<usize>, usize)>,
    /// Of each of these bands, the weights in the block.
    weights: Vec<[f32; LANES]>,
    /// Number of bands.
    count: usize,
}

impl Hats {
    fn new(places: &[BandPlace], count: usize) -> Self {
        let mut hats = Self { blocks: Vec::new(), weights: Vec::new(), count };
        for block in places.chunks(LANES) {
            let from = block.first().map_or(0, |place| place.band);
            let to = block.last().map_or(0, |place| place.band + 2).min(count);
            hats.blocks.push((from..to, hats.weights.len()));
            for band in from..to {
                hats.weights.push(std::array::from_fn(|i| match block.get(i) {
                    Some(place) if place.band == band => 1.0 - place.fraction,
                    Some(place) if place.band + 1 == band => place.fraction,
                    _ => 0.0,
                }));
            }
        }
        hats
    }

    /// Bands that reach into a block, with their weights there.
    #[inline(always)]
    fn of(&self, block: usize) -> (Range<usize>, &[[f32; LANES]]) {
        let (bands, first) = &self.blocks[block];
        (bands.clone(), &self.weights[*first..first + bands.len()])
    }
}

impl Taps {
    /// For a number of hops, and where every bin lies among `bands` bands.
    pub(crate) fn new(hops: usize, places: &[BandPlace], bands: usize) -> Self {
        let filters = vec![EarBlocks::default(); blocks_for(places.len()) * hops];
        Self { arch: Arch::new(), hops, hats: Hats::new(places, bands), filters }
    }

    /// The filters as `[block][hop]`.
    pub(crate) fn filters(&self) -> &[EarBlocks] {
        &self.filters
    }

    /// Hops of the filters.
    pub(crate) fn hops(&self) -> usize {
        self.hops
    }

    /// Sets some blocks of one hop from a hop of carriers, each with its share, less what they have lost, and gains per band,
    /// left then right.
    pub(crate) fn set(
        &mut self,
        hop: usize,
        (carriers, of_carriers): (&CarrierSet, usize),
        shares: &[(u32, f32)],
        band_gains: &[f32],
        blocks: Range<usize>,
        lost: Option<Lost<'_>>,
    ) {
        let mixture = Mixture::new(carriers, of_carriers, (shares, lost), &blocks);
        self.arch.dispatch(Coloured { taps: self, hop, mixture: mixture.parts(), band_gains, blocks });
    }

    /// Gains of the lowest bins, both ears, from gains per band, left then right.
    pub(crate) fn lowest_of(&self, band_gains: &[f32]) -> [[f32; LANES]; 2] {
        [0, 1].map(|ear| {
            let (bands, weights) = self.hats.of(0);
            let gains = &band_gains[ear * self.hats.count..][bands];
            let mut all = [0.0; LANES];
            for (weights, gain) in weights.iter().zip(gains) {
                all.iter_mut().zip(weights).for_each(|(all, weight)| *all += weight * gain);
            }
            all
        })
    }

    /// Adds a spectrum at gains per band to another.
    pub(crate) fn inject(&self, gains: &[f32], from: Slot<'_>, to: SlotMut<'_>) {
        self.arch.dispatch(Injected { hats: &self.hats, gains, from, to });
    }

    /// Silences the lowest block of bins of one hop.
    pub(crate) fn silence_lowest(&mut self, hop: usize) {
        self.filters[hop] = EarBlocks::default();
    }

    /// Delays the ears of the blocks of one hop that have just been set: the left by the phasors, the right by their
    /// conjugates.
    pub(crate) fn turn(&mut self, hop: usize, turn: &[Block], blocks: Range<usize>) {
        self.arch.dispatch(Turned { taps: self, hop, turn, blocks });
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.filters) + size_of_val(&*self.hats.weights)
    }
}

/// What carriers of one hop lose to image sources.
#[derive(Clone, Copy)]
pub(crate) struct Lost<'a> {
    pub(crate) carriers: &'a CarrierSet,
    pub(crate) hop: usize,
    /// How much of it, 0 to 1.
    pub(crate) share: f32,
}

/// Some blocks of one hop of carriers, each with its share, and of what they lose.
struct Mixture<'a> {
    parts: [(&'a [EarBlocks], f32); 2 * MOST_SHARES],
    count: usize,
}

impl<'a> Mixture<'a> {
    /// Of carriers, each with its share, without what they have lost.
    fn new(
        carriers: &'a CarrierSet,
        hop: usize,
        (shares, lost): (&[(u32, f32)], Option<Lost<'a>>),
        blocks: &Range<usize>,
    ) -> Self {
        let mut mixture = Self { parts: [(&[], 0.0); 2 * MOST_SHARES], count: 0 };
        let shares = &shares[..shares.len().min(MOST_SHARES)];
        mixture.add(carriers, hop, shares, 1.0, blocks);
        if let Some(lost) = lost {
            mixture.add(lost.carriers, lost.hop, shares, -lost.share, blocks);
        }
        mixture
    }

    fn add(&mut self, carriers: &'a CarrierSet, hop: usize, shares: &[(u32, f32)], gain: f32, blocks: &Range<usize>) {
        for (part, (response, share)) in self.parts[self.count..].iter_mut().zip(shares) {
            *part = (&carriers.hop(*response, hop)[blocks.clone()], gain * share);
        }
        self.count += shares.len();
    }

    fn parts(&self) -> &[(&'a [EarBlocks], f32)] {
        &self.parts[..self.count]
    }
}

/// One vector of a mix in one block.
#[inline(always)]
fn mixed<S: Simd>(simd: S, mixture: &[(&[EarBlocks], f32)], block: usize, vector: usize) -> [S::f32s; 4] {
    let mut sums = [simd.splat_f32s(0.0); 4];
    for (carrier, share) in mixture {
        let share = simd.splat_f32s(*share);
        let carrier = carrier[block].parts::<S>(vector);
        sums = times_plus(simd, [share; 4], carrier, sums);
    }
    sums
}

/// Mixes some blocks of one hop of carriers, each with its share, less what they have lost.
pub(crate) fn mix(
    arch: Arch,
    carriers: &CarrierSet,
    hop: usize,
    blocks: Range<usize>,
    parts: (&[(u32, f32)], Option<Lost<'_>>),
    out: &mut [EarBlocks],
) {
    let mixture = Mixture::new(carriers, hop, parts, &blocks);
    arch.dispatch(Mixed { mixture: mixture.parts(), out });
}

/// Adds the same at a gain.
pub(crate) fn add_mix(
    arch: Arch,
    carriers: &CarrierSet,
    hop: usize,
    parts: (&[(u32, f32)], Option<Lost<'_>>),
    gain: f32,
    out: &mut [EarBlocks],
) {
    let blocks = 0..out.len();
    let mixture = Mixture::new(carriers, hop, parts, &blocks);
    arch.dispatch(Added { mixture: mixture.parts(), gain, out });
}

struct Added<'a> {
    mixture: &'a [(&'a [EarBlocks], f32)],
    gain: f32,
    out: &'a mut [EarBlocks],
}

impl WithSimd for Added<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let gain = [simd.splat_f32s(self.gain); 4];
        for (block, out) in self.out.iter_mut().enumerate() {
            for vector in 0..LANES / S::F32_LANES {
                let sum = times_plus(simd, gain, mixed(simd, self.mixture, block, vector), out.parts::<S>(vector));
                out.put_parts::<S>(vector, sum);
            }
        }
    }
}

struct Mixed<'a> {
    mixture: &'a [(&'a [EarBlocks], f32)],
    out: &'a mut [EarBlocks],
}

impl WithSimd for Mixed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (block, out) in self.out.iter_mut().enumerate() {
            for vector in 0..LANES / S::F32_LANES {
                out.put_parts::<S>(vector, mixed(simd, self.mixture, block, vector));
            }
        }
    }
}

/// Sets some blocks of one hop to a mix times a gain per bin.
struct Coloured<'a> {
    taps: &'a mut Taps,
    hop: usize,
    mixture: &'a [(&'a [EarBlocks], f32)],
    band_gains: &'a [f32],
    blocks: Range<usize>,
}

impl WithSimd for Coloured<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { taps, hop, mixture, band_gains, blocks } = self;
        let (of_left, of_right) = band_gains.split_at(taps.hats.count);
        let filters = taps.filters[blocks.start * taps.hops..].chunks_exact_mut(taps.hops);
        for ((block, row), i) in blocks.zip(filters).zip(0..) {
            let (bands, weights) = taps.hats.of(block);
            let (of_left, of_right) = (&of_left[bands.clone()][..weights.len()], &of_right[bands][..weights.len()]);
            for vector in 0..LANES / S::F32_LANES {
                let (mut left, mut right) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
                for (band, weights) in weights.iter().enumerate() {
                    let weights = part::<S>(weights, vector);
                    left = simd.mul_add_e_f32s(simd.splat_f32s(of_left[band]), weights, left);
                    right = simd.mul_add_e_f32s(simd.splat_f32s(of_right[band]), weights, right);
                }
                let mixed = mixed(simd, mixture, i, vector);
                row[hop].put_parts::<S>(vector, times(simd, [left, left, right, right], mixed));
            }
        }
    }
}

struct Injected<'a> {
    hats: &'a Hats,
    gains: &'a [f32],
    from: Slot<'a>,
    to: SlotMut<'a>,
}

impl WithSimd for Injected<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { hats, gains, from, to } = self;
        for (block, (from, to)) in from.blocks().zip(to.blocks()).enumerate() {
            let mut all = [0.0; LANES];
            let (bands, weights) = hats.of(block);
            for (gain, weights) in gains[bands].iter().zip(weights) {
                all.iter_mut().zip(weights).for_each(|(all, weight)| *all += gain * weight);
            }
            for (i, gain) in all.iter().enumerate() {
                to.re[i] += gain * from.re[i];
                to.im[i] += gain * from.im[i];
            }
        }
    }
}

struct Turned<'a> {
    taps: &'a mut Taps,
    hop: usize,
    turn: &'a [Block],
    blocks: Range<usize>,
}

impl WithSimd for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { taps, hop, turn, blocks } = self;
        let rows = taps.filters.chunks_exact_mut(taps.hops).zip(turn);
        for (row, turn) in rows.take(blocks.end).skip(blocks.start) {
            let [left, right] = &mut row[hop].ears;
            for i in 0..LANES {
                let (l, r) = ((left.re[i], left.im[i]), (right.re[i], right.im[i]));
                left.re[i] = l.0 * turn.re[i] - l.1 * turn.im[i];
                left.im[i] = l.0 * turn.im[i] + l.1 * turn.re[i];
                right.re[i] = r.0 * turn.re[i] + r.1 * turn.im[i];
                right.im[i] = r.1 * turn.re[i] - r.0 * turn.im[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_fourier::num_complex::Complex32;

    #[test]
    fn gains_colour_the_carriers_and_a_turn_delays_the_ears_in_opposite_directions() {
        let bins = 40;
        let places: Vec<_> = (0..bins).map(|k| BandPlace { band: 0, fraction: k as f32 / bins as f32 }).collect();
        let carrier = Complex32::new(0.5, 0.25);
        let all = 0..blocks_for(bins);
        let spectra = vec![carrier; bins];
        let carriers = CarrierSet::pack(std::iter::repeat_n([spectra.clone(), spectra], 6), 3, bins);
        let mut taps = Taps::new(3, &places, 2);
        // Left 1 to 2, right 4 throughout.
        taps.set(1, (&carriers, 1), &[(0, 0.75), (1, 0.25)], &[1.0, 2.0, 4.0, 4.0], all.clone(), None);
        let phasor = Complex32::from_polar(1.0, -0.7);
        let turn = vec![Block { re: [phasor.re; LANES], im: [phasor.im; LANES] }; blocks_for(bins)];
        taps.turn(1, &turn, all);
        for (k, place) in places.iter().enumerate() {
            let row = &taps.filters()[k / LANES * 3..][..3];
            let at = |hop: usize, ear: usize| {
                let b = &row[hop].ears[ear];
                Complex32::new(b.re[k % LANES], b.im[k % LANES])
            };
            assert!((at(1, 0) - carrier * (1.0 + place.fraction) * phasor).norm() < 1e-6);
            assert!((at(1, 1) - carrier * 4.0 * phasor.conj()).norm() < 1e-6);
            assert_eq!(at(0, 0), Complex32::default(), "other hops are as they were");
        }
    }
}
