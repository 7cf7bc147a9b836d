//! Time filters: fixed carriers coloured by gains per band.

use crate::bands::BandPlace;
use crate::render::carrier::EarSpectra;
use crate::render::lanes::{Block, EarBlocks, LANES, blocks_for};
use pulp::{Arch, WithSimd};
use std::ops::Range;

/// A run of hops, each a carrier per ear times a gain per bin.
pub(crate) struct Taps {
    arch: Arch,
    hops: usize,
    /// Bins of each interval between two bands.
    intervals: Vec<Range<usize>>,
    fractions: Vec<f32>,
    /// Gains per bin of the hop that is being set, left and right.
    gains: [Vec<f32>; 2],
    carriers: Vec<EarBlocks>,
    filters: Vec<EarBlocks>,
}

impl Taps {
    /// Takes the carriers, one pair of spectra per hop, and where every bin lies among `bands` bands.
    pub(crate) fn new(carriers: &[EarSpectra], places: &[BandPlace], bands: usize) -> Self {
        let (hops, blocks) = (carriers.len(), blocks_for(places.len()));
        let mut packed = vec![EarBlocks::default(); blocks * hops];
        for (hop, ears) in carriers.iter().enumerate() {
            for (ear, spectrum) in ears.iter().enumerate() {
                for (k, x) in spectrum.iter().enumerate() {
                    let block = &mut packed[k / LANES * hops + hop].ears[ear];
                    block.re[k % LANES] = x.re;
                    block.im[k % LANES] = x.im;
                }
            }
        }
        let start = |band: usize| places.partition_point(|p| p.band < band);
        Self {
            arch: Arch::new(),
            hops,
            intervals: (0..bands - 1).map(|b| start(b)..start(b + 1)).collect(),
            fractions: places.iter().map(|p| p.fraction).collect(),
            gains: [vec![0.0; blocks * LANES], vec![0.0; blocks * LANES]],
            carriers: packed,
            filters: vec![EarBlocks::default(); blocks * hops],
        }
    }

    /// Number of hops.
    pub(crate) fn hops(&self) -> usize {
        self.hops
    }

    /// The filters as `[block][hop]`.
    pub(crate) fn filters(&self) -> &[EarBlocks] {
        &self.filters
    }

    /// Sets one hop from gains per band, left then right.
    pub(crate) fn set(&mut self, hop: usize, band_gains: &[f32]) {
        self.arch.dispatch(Coloured { taps: self, hop, band_gains });
    }

    /// Delays the ears of one hop that has just been set: the left by the phasors, the right by their conjugates.
    pub(crate) fn turn(&mut self, hop: usize, turn: &[Block]) {
        self.arch.dispatch(Turned { taps: self, hop, turn });
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        (self.carriers.len() + self.filters.len()) * size_of::<EarBlocks>()
    }
}

struct Coloured<'a> {
    taps: &'a mut Taps,
    hop: usize,
    band_gains: &'a [f32],
}

impl WithSimd for Coloured<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        let Self { taps, hop, band_gains } = self;
        let bands = taps.intervals.len() + 1;
        for (gains, bands) in taps.gains.iter_mut().zip(band_gains.chunks_exact(bands)) {
            for (interval, pair) in taps.intervals.iter().zip(bands.windows(2)) {
                let (low, step) = (pair[0], pair[1] - pair[0]);
                let fractions = &taps.fractions[interval.clone()];
                for (g, f) in gains[interval.clone()].iter_mut().zip(fractions) {
                    *g = low + f * step;
                }
            }
        }
        let [left, right] = &taps.gains;
        let gains = left.as_chunks::<LANES>().0.iter().zip(right.as_chunks::<LANES>().0);
        let rows = taps.carriers.chunks_exact(taps.hops).zip(taps.filters.chunks_exact_mut(taps.hops));
        for ((left, right), (carriers, filters)) in gains.zip(rows) {
            let (carrier, filter) = (&carriers[hop].ears, &mut filters[hop].ears);
            for i in 0..LANES {
                filter[0].re[i] = carrier[0].re[i] * left[i];
                filter[0].im[i] = carrier[0].im[i] * left[i];
                filter[1].re[i] = carrier[1].re[i] * right[i];
                filter[1].im[i] = carrier[1].im[i] * right[i];
            }
        }
    }
}

struct Turned<'a> {
    taps: &'a mut Taps,
    hop: usize,
    turn: &'a [Block],
}

impl WithSimd for Turned<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) {
        for (row, turn) in self.taps.filters.chunks_exact_mut(self.taps.hops).zip(self.turn) {
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
        let carrier = vec![Complex32::new(0.5, 0.25); bins];
        let mut taps = Taps::new(&vec![[carrier.clone(), carrier.clone()]; 3], &places, 2);
        // Left 1 to 2, right 4 throughout.
        taps.set(1, &[1.0, 2.0, 4.0, 4.0]);
        let phasor = Complex32::from_polar(1.0, -0.7);
        let turn = vec![Block { re: [phasor.re; LANES], im: [phasor.im; LANES] }; blocks_for(bins)];
        taps.turn(1, &turn);
        for (k, place) in places.iter().enumerate() {
            let row = &taps.filters()[k / LANES * 3..][..3];
            let at = |hop: usize, ear: usize| {
                let b = &row[hop].ears[ear];
                Complex32::new(b.re[k % LANES], b.im[k % LANES])
            };
            assert!((at(1, 0) - carrier[k] * (1.0 + place.fraction) * phasor).norm() < 1e-6);
            assert!((at(1, 1) - carrier[k] * 4.0 * phasor.conj()).norm() < 1e-6);
            assert_eq!(at(0, 0), Complex32::default(), "other hops are as they were");
        }
    }
}
