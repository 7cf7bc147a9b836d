//! The bass of a measured direct sound, which lasts longer than the hop that the rest of it fits into.

use crate::render::carrier::set::CarrierSet;
use crate::render::early::taps::mix;
use crate::render::transform::lanes::{Accumulate, EarBlocks};
use crate::render::transform::ring::Slot;
use pulp::Arch;

/// Heard where the room is not: with the room, its taps have the same sound.
pub(crate) struct Bass {
    arch: Arch,
    hops: usize,
    /// Hops that are played apart.
    apart: usize,
    /// `[block][hop]`
    filters: Vec<EarBlocks>,
    mixed: Vec<EarBlocks>,
    sums: Vec<EarBlocks>,
    /// Whether the pose has changed since the filters were set.
    stale: bool,
}

impl Bass {
    /// The first `apart` hops are played apart, and the others so many hops earlier.
    pub(crate) fn new(carriers: Option<&CarrierSet>, apart: usize) -> Self {
        let (hops, blocks) = carriers.map_or((0, 0), |set| (set.hops(), set.blocks()));
        let silent = |count| vec![EarBlocks::default(); count];
        Self {
            arch: Arch::new(),
            hops,
            apart,
            filters: silent(hops * blocks),
            mixed: silent(blocks),
            sums: silent(blocks),
            stale: true,
        }
    }

    /// The filters as `[block][hop]`, and their hops.
    pub(crate) fn filters(&self) -> &[EarBlocks] {
        &self.filters
    }

    pub(crate) fn hops(&self) -> usize {
        self.hops
    }

    /// The pose has changed.
    pub(crate) fn forget_pose(&mut self) {
        self.stale = true;
    }

    /// Sets the filters from carriers, each with its share, if the pose has changed.
    pub(crate) fn set(&mut self, carriers: &CarrierSet, shares: &[(u32, f32)], gain: f32) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        for hop in 0..self.hops {
            mix(self.arch, carriers, hop, 0..self.mixed.len(), (shares, None), &mut self.mixed);
            let filters = self.filters.iter_mut().skip(hop).step_by(self.hops);
            for (filter, mixed) in filters.zip(&self.mixed) {
                *filter = *mixed;
                scale(filter, gain);
            }
        }
    }

    /// Adds its sound at a level to the sums.
    pub(crate) fn add(&mut self, newest: Slot<'_>, level: f32, sums: &mut [EarBlocks]) {
        let Self { arch, hops, apart, filters, sums: own, .. } = self;
        let taps = *apart..*hops;
        if taps.is_empty() || level == 0.0 {
            return;
        }
        own.fill(EarBlocks::default());
        Accumulate { arch: *arch, newest: [newest], filter: filters, hops: *hops, taps, sums: own }.run();
        for (sum, own) in sums.iter_mut().zip(own) {
            scale(own, level);
            for (sum, own) in sum.ears.iter_mut().zip(&own.ears) {
                sum.re.iter_mut().zip(&own.re).for_each(|(s, o)| *s += o);
                sum.im.iter_mut().zip(&own.im).for_each(|(s, o)| *s += o);
            }
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        (self.filters.len() + self.mixed.len() + self.sums.len()) * size_of::<EarBlocks>()
    }
}

fn scale(blocks: &mut EarBlocks, gain: f32) {
    for ear in &mut blocks.ears {
        ear.re.iter_mut().chain(&mut ear.im).for_each(|v| *v *= gain);
    }
}
