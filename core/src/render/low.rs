//! The bass of measured rooms: the lowest bins ring on as they were measured.

use crate::render::carrier_set::CarrierSet;
use crate::render::lanes::{Accumulate, Block, EarBlocks, LANES};
use crate::render::ring::Ring;
use crate::render::taps::mix;
use promenade_fourier::num_complex::Complex32;
use pulp::Arch;

/// Bins of the lowest block, from 0 Hz on: in scenes with measured responses they have no late part, but ring on as was
/// measured.
pub const LOWEST_BINS: usize = LANES;

/// Hops of measured responses after the explicit taps, in the lowest block of bins.
///
/// In a band of 100 Hz noise of one hop has few degrees of freedom, and a decay of its own in every draw; the measured hops
/// cost next to nothing in so few bins.
pub(crate) struct Low {
    arch: Arch,
    taps: usize,
    filters: Vec<EarBlocks>,
    /// The newest input of the block, one hop a slot.
    ring: Ring,
    mixed: [EarBlocks; 1],
}

impl Low {
    /// For `hops` hops after `taps` explicit taps.
    pub(crate) fn new(hops: usize, taps: usize) -> Self {
        Self {
            arch: Arch::new(),
            taps,
            filters: vec![EarBlocks::default(); hops],
            ring: Ring::new(1, taps + 1 + hops),
            mixed: [EarBlocks::default()],
        }
    }

    pub(crate) fn hops(&self) -> usize {
        self.filters.len()
    }

    /// Sets one hop from carriers, each with its share, and gains of both ears per bin.
    pub(crate) fn set(&mut self, hop: usize, carriers: &CarrierSet, shares: &[(u32, f32)], gains: &[[f32; LANES]; 2]) {
        mix(self.arch, carriers, hop, 0..1, (shares, None), &mut self.mixed);
        for ((filter, mixed), gains) in self.filters[hop].ears.iter_mut().zip(&self.mixed[0].ears).zip(gains) {
            for (i, gain) in gains.iter().enumerate() {
                filter.re[i] = gain * mixed.re[i];
                filter.im[i] = gain * mixed.im[i];
            }
        }
    }

    /// Takes the newest frame.
    pub(crate) fn write(&mut self, spectrum: &[Complex32]) {
        self.ring.write(spectrum);
    }

    /// Replaces the frame that is `age` frames older than the newest.
    pub(crate) fn rewrite(&mut self, age: usize, lowest: &Block) {
        self.ring.at_mut(age).blocks().for_each(|block| *block = *lowest);
    }

    /// Adds its sound to the sums, of which it reaches the lowest block.
    pub(crate) fn add(&self, sums: &mut [EarBlocks]) {
        let hops = self.filters.len();
        let newest = [self.ring.at(self.taps + 1)];
        Accumulate { arch: self.arch, newest, filter: &self.filters, hops, taps: 0..hops, sums }.run();
    }

    pub(crate) fn reset(&mut self) {
        self.ring.reset();
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.filters.len() * size_of::<EarBlocks>() + self.ring.memory_bytes()
    }
}
