//! What of a room comes after its explicit taps: the late part, and the bass of measured responses.

use crate::number::single;
use crate::render::ahead::{Applied, FRAMES};
use crate::render::carrier::per_bin;
use crate::render::carriers::Carriers;
use crate::render::decay::Decay;
use crate::render::lanes::{Accumulate, Block, EarBlocks, blocks_for};
use crate::render::late::{LATE_HOPS, Late, late_gain, left_ear};
use crate::render::low::Low;
use crate::render::meeting::Mixture;
use crate::render::ring::{Ring, Slot};
use crate::render::taps::Taps;
use crate::transfer::Shares;
use crate::{StftGrid, TailModel, TransferFunction, TransferShape};
use glam::{Quat, Vec2};
use promenade_fourier::num_complex::Complex32;
use pulp::Arch;
use std::ops::Range;

/// The late network with the noise that colours it, and the lowest bins of measured responses.
pub(crate) struct Later {
    arch: Arch,
    shape: TransferShape,
    filters: Taps,
    network: Late,
    low: Low,
    /// How loud each late hop is for an amplitude of 1, `[hop][band]`.
    levels: Vec<f32>,
    /// Gains of one late hop and of the bass after the taps, both ears.
    late_gains: Vec<f32>,
    low_gains: Vec<f32>,
    /// The newest spectra of the network, of each ear.
    tails: [Ring; 2],
    /// Where the left ear has been in the newest frames, along the world's horizontal axes. The network takes the pose that its
    /// frames are heard with where it has the most time, so that it plays the same where it has less.
    left: [Vec2; FRAMES],
    /// Frames by which the network is ahead of those that are heard.
    ahead: usize,
}

impl Later {
    /// Of a scene whose transfer functions have a shape and are sampled on `scene_grid`; the network is fed by `ahead` frames
    /// earlier than it is heard.
    pub(crate) fn new(
        grid: &StftGrid,
        scene_grid: &StftGrid,
        shape: TransferShape,
        tail: &TailModel,
        carriers: &Carriers,
        decay: &Decay,
        ahead: usize,
    ) -> Self {
        let low_hops = carriers.measured.as_ref().map_or(0, |m| m.low.hops());
        let mut later = Self {
            arch: Arch::new(),
            shape,
            filters: Taps::new(LATE_HOPS, &carriers.places, shape.bands),
            network: Late::new(grid, scene_grid, tail, decay.stated_bins(), &per_bin(&carriers.places, &tail.coherence)),
            low: Low::new(low_hops, shape.taps - carriers.pace.early_hops()),
            levels: vec![0.0; LATE_HOPS * shape.bands],
            late_gains: vec![0.0; shape.tap_len()],
            low_gains: vec![1.0; shape.tap_len()],
            tails: [(); 2].map(|()| Ring::new(blocks_for(grid.bins()), LATE_HOPS + ahead)),
            left: [Vec2::Y; FRAMES],
            ahead,
        };
        later.set_levels(decay);
        later
    }

    fn set_levels(&mut self, decay: &Decay) {
        let taps = self.shape.taps;
        for (hop, levels) in self.levels.chunks_exact_mut(self.shape.bands).enumerate() {
            for (level, (decay, ratio)) in levels.iter_mut().zip(decay.hops()) {
                *level = Late::carrier_gain() * single(late_gain(decay, ratio, hop, taps));
            }
        }
    }

    /// Hops of the late part and of the bass together.
    pub(crate) fn hops(&self) -> usize {
        LATE_HOPS + self.low.hops()
    }

    /// Turns the late field with the head, at once or as the frames come.
    pub(crate) fn face(&mut self, orientation: Quat, at_once: bool) {
        let newest = left_ear(orientation, self.left[0]);
        if at_once {
            self.left = [newest; FRAMES];
        } else {
            self.left.rotate_right(1);
            self.left[0] = newest;
        }
    }

    /// Takes another decay.
    pub(crate) fn decay_by(&mut self, decay: &Decay) {
        self.network.decay_by(decay.ratio_bins());
        self.set_levels(decay);
    }

    /// Takes the gains of the last tap, which the bass goes on with.
    pub(crate) fn go_on(&mut self, tf: &TransferFunction, mixture: &Mixture<'_>) {
        let Some(last) = tf.taps.rchunks_exact(self.shape.tap_len()).next() else { return };
        self.low_gains.copy_from_slice(last);
        mixture.apply(self.arch, self.shape.taps, &tf.late, &mut self.low_gains);
    }

    /// Brings one hop to the pose: those of the late part are counted first, then those of the bass. The blocks of the lowest
    /// bins are brought there where they are given, and the others that are given.
    pub(crate) fn set(
        &mut self,
        hop: usize,
        tf: &TransferFunction,
        decay: &mut Decay,
        carriers: &Carriers,
        lowest: Option<Range<usize>>,
        others: Range<usize>,
    ) {
        let after = self.shape.taps + 1;
        if let Some(bass) = hop.checked_sub(LATE_HOPS) {
            if let (Some(measured), Some(_)) = (&carriers.measured, lowest) {
                let gains = self.filters.lowest_of(decay.gains(&self.low_gains, after + bass));
                self.low.set(bass, &measured.low, tf.shares.entries(), &gains);
            }
            return;
        }
        // The late part starts early enough to be at full level one hop after the last tap; its gain is stated there.
        self.late_gains.copy_from_slice(decay.gains(&tf.late, after));
        let levels = &self.levels[hop * self.shape.bands..];
        for gains in self.late_gains.chunks_exact_mut(self.shape.bands) {
            gains.iter_mut().zip(levels).for_each(|(gain, level)| *gain *= level);
        }
        let is_lowest = lowest.is_some();
        for blocks in lowest.into_iter().chain([others]) {
            self.filters.set(hop, &carriers.late, Shares::FIRST.entries(), &self.late_gains, blocks, None);
        }
        if carriers.measured.is_some() && is_lowest {
            self.filters.silence_lowest(hop);
        }
    }

    /// Takes the newest frame for the bass.
    pub(crate) fn write(&mut self, spectrum: &[Complex32]) {
        self.low.write(spectrum);
    }

    /// Replaces the lowest block of the frame that is `age` frames older than the newest.
    pub(crate) fn rewrite(&mut self, age: usize, lowest: &Block) {
        self.low.rewrite(age, lowest);
    }

    /// Frames by which the network is ahead.
    pub(crate) fn ahead(&self) -> usize {
        self.ahead
    }

    /// From now on the network is fed when it is heard.
    pub(crate) fn wait(&mut self) {
        self.ahead = 0;
    }

    /// Feeds the network, whose output is heard so many frames later.
    pub(crate) fn advance(&mut self, input: Slot<'_>) {
        self.network.advance(input, self.left[FRAMES - 1 - self.ahead], self.tails.each_mut().map(Ring::advance));
    }

    /// The late part's filters on the frames of the network, for frames that are worked out ahead.
    pub(crate) fn applied(&self) -> Applied<'_> {
        let [newest, right] = self.tails.each_ref().map(|tail| tail.at(0));
        Applied { newest, right: Some(right), filter: self.filters.filters(), hops: LATE_HOPS, first_tap: 0 }
    }

    /// Adds its sound to both ears, in as many blocks of bins as there are.
    pub(crate) fn add(&self, sums: &mut [EarBlocks]) {
        let newest = self.tails.each_ref().map(|tail| tail.at(self.ahead));
        let (filter, hops) = (self.filters.filters(), LATE_HOPS);
        Accumulate { arch: self.arch, newest, filter, hops, taps: 0..hops, sums }.run();
        self.low.add(sums);
    }

    /// Whether nothing is left in the network.
    pub(crate) fn is_silent(&self) -> bool {
        self.network.is_silent()
    }

    /// Empties the late part.
    pub(crate) fn forget(&mut self) {
        self.tails.iter_mut().for_each(Ring::reset);
        self.network.reset();
    }

    pub(crate) fn reset(&mut self) {
        self.low.reset();
        self.left = [Vec2::Y; FRAMES];
        self.forget();
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let tails: usize = self.tails.iter().map(Ring::memory_bytes).sum();
        tails + self.filters.memory_bytes() + self.network.memory_bytes() + self.low.memory_bytes()
    }
}
