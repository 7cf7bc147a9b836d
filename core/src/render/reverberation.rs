//! What of a room comes after its explicit taps.

use crate::number::single;
use crate::render::carrier::noise::per_bin;
use crate::render::carriers::Carriers;
use crate::render::early::taps::Taps;
use crate::render::early::taps_ahead::{Applied, FRAMES};
use crate::render::late::decay::Decay;
use crate::render::late::network::{LATE_HOPS, Late, late_gain, left_ear};
use crate::render::transform::lanes::{Accumulate, EarBlocks, blocks_for};
use crate::render::transform::ring::{Ring, Slot};
use crate::render::voice_filters::Plan;
use crate::transfer::Shares;
use crate::{TransferFunction, TransferShape};
use glam::{Quat, Vec2};
use pulp::Arch;
use std::ops::Range;

/// What the ears' axis turns by in the late field from one frame to the next, at most, radians: 12 degrees, 2400 a second at
/// hops of 5 ms.
const MOST_TURN: f32 = 0.21;

/// The late network with the noise that colours it.
pub(crate) struct Later {
    arch: Arch,
    shape: TransferShape,
    filters: Taps,
    network: Late,
    /// How loud each late hop is for an amplitude of 1, `[hop][band]`.
    levels: Vec<f32>,
    /// Gains of one late hop, both ears.
    late_gains: Vec<f32>,
    /// The newest spectra of the network, of each ear.
    tails: [Ring; 2],
    /// Where the left ear has been in the newest frames, along the world's horizontal axes. The network takes the pose that its
    /// frames are heard with where it has the most time, so that it plays the same where it has less.
    left: [Vec2; FRAMES],
    /// Frames by which the network is ahead of those that are heard.
    ahead: usize,
}

impl Later {
    /// The network is fed by `ahead` frames earlier than it is heard.
    pub(crate) fn new(plan: &Plan<'_>, decay: &Decay, ahead: usize) -> Self {
        let Plan { grid, scene_grid, shape, tail, carriers, .. } = *plan;
        let coherence = per_bin(&carriers.places, &tail.coherence);
        let mut later = Self {
            arch: Arch::new(),
            shape,
            filters: Taps::new(LATE_HOPS, &carriers.places, shape.bands),
            network: Late::new(grid, scene_grid, tail, decay.stated_bins(), &coherence),
            levels: vec![0.0; LATE_HOPS * shape.bands],
            late_gains: vec![0.0; shape.tap_len()],
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

    /// Turns the late field with the head, at once or as the frames come.
    pub(crate) fn face(&mut self, orientation: Quat, at_once: bool) {
        let wanted = left_ear(orientation, self.left[0]);
        let newest = if at_once { wanted } else { glided(self.left[0], wanted) };
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

    /// Brings one hop to the pose, in the blocks of the lowest bins where they are given, and the others that are given.
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
        // The late part starts early enough to be at full level one hop after the last tap; its gain is stated there.
        self.late_gains.copy_from_slice(decay.gains(&tf.late, after));
        let levels = &self.levels[hop * self.shape.bands..];
        for gains in self.late_gains.chunks_exact_mut(self.shape.bands) {
            gains.iter_mut().zip(levels).for_each(|(gain, level)| *gain *= level);
        }
        let is_lowest = lowest.is_some();
        for blocks in lowest.into_iter().chain([others]) {
            self.filters.set(hop, (&carriers.late, hop), Shares::FIRST.entries(), &self.late_gains, blocks, None);
        }
        if carriers.measured.is_some() && is_lowest {
            self.filters.silence_lowest(hop);
        }
    }

    /// Frames by which the network is ahead.
    pub(crate) fn ahead(&self) -> usize {
        self.ahead
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
        self.left = [Vec2::Y; FRAMES];
        self.forget();
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let tails: usize = self.tails.iter().map(Ring::memory_bytes).sum();
        tails + self.filters.memory_bytes() + self.network.memory_bytes()
    }
}

/// The ears' axis a frame later: a head that rolls past a right angle has it the other way round from one pose to the next.
fn glided(from: Vec2, wanted: Vec2) -> Vec2 {
    if from.dot(wanted) >= MOST_TURN.cos() { wanted } else { from.rotate_towards(wanted, MOST_TURN) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_that_rolls_past_a_right_angle_turns_the_field_about_slowly() {
        let at = |degrees: f32| left_ear(Quat::from_rotation_x(degrees.to_radians()), Vec2::Y);
        let (from, wanted) = (at(89.0), at(91.0));
        assert!(from.dot(wanted) < -0.99);
        let (mut axis, mut frames) = (from, 0);
        while axis != wanted {
            let next = glided(axis, wanted);
            assert!(axis.angle_to(next).abs() < MOST_TURN + 1e-3, "{axis} {next}");
            (axis, frames) = (next, frames + 1);
            assert!(frames < 20);
        }
        assert!(frames > 10, "{frames}");
    }
}
