//! The bass of measured rooms: the lowest bins ring on as they were measured.

use crate::render::carrier::set::CarrierSet;
use crate::render::early::taps::{Lost, mix};
use crate::render::transform::lanes::{Accumulate, EarBlocks, LANES};
use crate::render::transform::ring::Ring;
use promenade_fourier::num_complex::Complex32;
use pulp::Arch;
use std::ops::Range;

/// Bins of the lowest block, from 0 Hz on: in scenes with measured responses they have no late part, but ring on as was
/// measured.
pub const LOWEST_BINS: usize = LANES;

/// Hops of measured responses after a voice's explicit taps, in the lowest block of bins.
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

    /// Sets one hop from a hop of carriers, each with its share, less what they have lost, and gains of both ears per bin.
    pub(crate) fn set(
        &mut self,
        hop: usize,
        (carriers, of_carriers): (&CarrierSet, usize),
        parts: (&[(u32, f32)], Option<Lost<'_>>),
        gains: &[[f32; LANES]; 2],
    ) {
        mix(self.arch, carriers, of_carriers, 0..1, parts, &mut self.mixed);
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

    /// Adds the sound of some hops to the sums, of which it reaches the lowest block.
    pub(crate) fn add(&self, taps: Range<usize>, sums: &mut [EarBlocks]) {
        let newest = [self.ring.at(self.taps + 1 + taps.start)];
        Accumulate { arch: self.arch, newest, filter: &self.filters, hops: self.filters.len(), taps, sums }.run();
    }

    pub(crate) fn reset(&mut self) {
        self.ring.reset();
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.filters.len() * size_of::<EarBlocks>() + self.ring.memory_bytes()
    }
}
