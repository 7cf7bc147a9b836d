//! Time filters: carriers, mixed and coloured by gains per band.

use crate::bands::BandPlace;
use crate::render::carrier_set::CarrierSet;
use crate::render::lanes::{Block, EarBlocks, LANES, blocks_for};
use pulp::{Arch, WithSimd};
use std::ops::Range;

/// A run of hops, each a mix of carriers per ear times a gain per bin.
pub(crate) struct Taps {
    arch: Arch,
    hops: usize,
    /// Bins of each interval between two bands.
    intervals: Vec<Range<usize>>,
    fractions: Vec<f32>,
    /// Gains per bin of the hop that is being set, left and right.
    gains: [Vec<f32>; 2],
    /// The mix of the hop that is being set.
    mixed: Vec<EarBlocks>,
    filters: Vec<EarBlocks>,
}

impl Taps {
    /// For a number of hops, and where every bin lies among `bands` bands.
    pub(crate) fn new(hops: usize, places: &[BandPlace], bands: usize) -> Self {
        let blocks = blocks_for(places.len());
        let start = |band: usize| places.partition_point(|p| p.band < band);
        Self {
            arch: Arch::new(),
            hops,
            intervals: (0..bands - 1).map(|b| start(b)..start(b + 1)).collect(),
            fractions: places.iter().map(|p| p.fraction).collect(),
            gains: [vec![0.0; blocks * LANES], vec![0.0; blocks * LANES]],
            mixed: vec![EarBlocks::default(); blocks],
            filters: vec![EarBlocks::default(); blocks * hops],
        }
    }

    /// The filters as `[block][hop]`.
    pub(crate) fn filters(&self) -> &[EarBlocks] {
        &self.filters
    }

    /// Sets some blocks of one hop from carriers, each with its share, and gains per band, left then right.
    pub(crate) fn set(
        &mut self,
        hop: usize,
        carriers: &CarrierSet,
        shares: &[(u32, f32)],
        band_gains: &[f32],
        blocks: Range<usize>,
    ) {
        let part = |response: u32| &carriers.hop(response, hop)[blocks.clone()];
        let arch = self.arch;
        match *shares {
            [(one, share)] => {
                let pair = [part(one); 2];
                arch.dispatch(Coloured { taps: self, hop, pair, shares: [share, 0.0], band_gains, blocks });
            }
            [(one, share), (other, rest)] => {
                let pair = [part(one), part(other)];
                arch.dispatch(Coloured { taps: self, hop, pair, shares: [share, rest], band_gains, blocks });
            }
            _ => {
                let mut mixed = std::mem::take(&mut self.mixed);
                let part = &mut mixed[blocks.clone()];
                mix(arch, carriers, hop, blocks.clone(), shares, part);
                let pair = [&*part; 2];
                arch.dispatch(Coloured { taps: self, hop, pair, shares: [1.0, 0.0], band_gains, blocks });
                self.mixed = mixed;
            }
        }
    }

    /// Gains of the lowest bins, both ears, from gains per band, left then right.
    pub(crate) fn lowest_of(&self, band_gains: &[f32]) -> [[f32; LANES]; 2] {
        let bands = self.intervals.len() + 1;
        let band = |i: usize| self.intervals.iter().position(|range| range.contains(&i)).unwrap_or(0);
        [0, 1].map(|ear| {
            std::array::from_fn(|i| {
                let pair = &band_gains[ear * bands + band(i)..];
                pair[0] + self.fractions.get(i).unwrap_or(&0.0) * (pair[1] - pair[0])
            })
        })
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
        (self.filters.len() + self.mixed.len()) * size_of::<EarBlocks>()
    }
}

/// Mixes some blocks of one hop of carriers, each with its share.
pub(crate) fn mix(
    arch: Arch,
    carriers: &CarrierSet,
    hop: usize,
    blocks: Range<usize>,
    shares: &[(u32, f32)],
    out: &mut [EarBlocks],
) {
    if shares.is_empty() {
        out.fill(EarBlocks::default());
    }
    for (i, (response, share)) in shares.iter().enumerate() {
        let carrier = &carriers.hop(*response, hop)[blocks.clone()];
        arch.dispatch(AddShare { carrier, share: *share, adds: i > 0, out });
    }
}

/// Writes or adds a share of a carrier.
struct AddShare<'a> {
    carrier: &'a [EarBlocks],
    share: f32,
    adds: bool,
    out: &'a mut [EarBlocks],
}

impl WithSimd for AddShare<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { carrier, share, adds, out } = self;
        let old = if adds { 1.0 } else { 0.0 };
        for (out, carrier) in out.iter_mut().zip(carrier) {
            for (out, carrier) in out.ears.iter_mut().zip(&carrier.ears) {
                for i in 0..LANES {
                    out.re[i] = old * out.re[i] + share * carrier.re[i];
                    out.im[i] = old * out.im[i] + share * carrier.im[i];
                }
            }
        }
    }
}

/// Sets one hop from two carriers, of which the second may have no share.
struct Coloured<'a> {
    taps: &'a mut Taps,
    hop: usize,
    pair: [&'a [EarBlocks]; 2],
    shares: [f32; 2],
    band_gains: &'a [f32],
    blocks: Range<usize>,
}

impl WithSimd for Coloured<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { taps, hop, pair, shares, band_gains, blocks } = self;
        let bins = blocks.start * LANES..blocks.end * LANES;
        let bands = taps.intervals.len() + 1;
        for (gains, bands) in taps.gains.iter_mut().zip(band_gains.chunks_exact(bands)) {
            for (interval, pair) in taps.intervals.iter().zip(bands.windows(2)) {
                let (low, step) = (pair[0], pair[1] - pair[0]);
                let interval = interval.start.max(bins.start)..interval.end.min(bins.end);
                if interval.is_empty() {
                    continue;
                }
                let fractions = &taps.fractions[interval.clone()];
                for (g, f) in gains[interval].iter_mut().zip(fractions) {
                    *g = low + f * step;
                }
            }
        }
        let [left, right] = &taps.gains;
        let gains = left[bins.clone()].as_chunks::<LANES>().0.iter().zip(right[bins].as_chunks::<LANES>().0);
        let filters = taps.filters[blocks.start * taps.hops..].iter_mut().skip(hop).step_by(taps.hops);
        let rows = gains.zip(filters).zip(pair[0].iter().zip(pair[1]));
        let [share, rest] = shares;
        if rest == 0.0 {
            for (((left, right), filter), (one, _)) in rows {
                for ((filter, one), gains) in filter.ears.iter_mut().zip(&one.ears).zip([left, right]) {
                    for (i, gain) in gains.iter().enumerate() {
                        let gain = share * gain;
                        filter.re[i] = gain * one.re[i];
                        filter.im[i] = gain * one.im[i];
                    }
                }
            }
            return;
        }
        for (((left, right), filter), (one, other)) in rows {
            let ears = filter.ears.iter_mut().zip(one.ears.iter().zip(&other.ears)).zip([left, right]);
            for ((filter, (one, other)), gains) in ears {
                for (i, gain) in gains.iter().enumerate() {
                    filter.re[i] = gain * (share * one.re[i] + rest * other.re[i]);
                    filter.im[i] = gain * (share * one.im[i] + rest * other.im[i]);
                }
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
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        for (row, turn) in
            self.taps.filters.chunks_exact_mut(self.taps.hops).zip(self.turn).take(self.blocks.end).skip(self.blocks.start)
        {
            let [left, right] = &mut row[self.hop].ears;
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
        taps.set(1, &carriers, &[(0, 0.75), (1, 0.25)], &[1.0, 2.0, 4.0, 4.0], all.clone());
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
