//! What comes in on the main input.

use crate::parameter::cast::{index, narrow};
use nice_plug::prelude::Buffer;
use promenade_core::Ramp;
use std::ops::Range;

/// Time in which a step of the level is taken, seconds.
const RAMP_S: f64 = 0.001;

/// A copy of the input, because hosts hand over the same buffer for input and output.
#[derive(Default)]
pub(super) struct Input {
    /// 1 for mono, else 2.
    pub(super) channels: usize,
    copy: [Vec<f32>; 2],
    /// What the channels are taken at.
    levels: Option<[Ramp; 2]>,
    /// Where the second channel of a pair goes whose first is the last.
    nowhere: Vec<f32>,
    #[cfg(feature = "standalone")]
    playhead: crate::playing::player::Playhead,
}

impl Input {
    /// Makes room for blocks of up to `longest` samples.
    pub(super) fn resize(&mut self, channels: usize, longest: usize) {
        self.channels = if channels == 1 { 1 } else { 2 };
        self.copy.iter_mut().chain([&mut self.nowhere]).for_each(|channel| channel.resize(longest, 0.0));
    }

    /// Samples that there is room for.
    pub(super) fn longest(&self) -> usize {
        self.copy[0].len().max(1)
    }

    /// The next level is taken at once.
    pub(super) fn reset(&mut self) {
        self.levels = None;
    }

    /// Brings the input of a block to a gain.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn take(&mut self, channels: &mut [&mut [f32]], gain: f32, sample_rate_hz: f64) {
        let levels = self.levels.get_or_insert([Ramp::at(gain); 2]);
        for (level, channel) in levels.iter_mut().zip(channels).take(self.channels) {
            level.aim(gain, index(narrow(RAMP_S * sample_rate_hz)));
            level.apply(channel);
        }
    }

    /// Copies the first two channels of a stretch of a block, at most [`Input::longest`], and gives room for an output that
    /// nobody hears.
    pub(super) fn copied(&mut self, channels: &[&mut [f32]], span: Range<usize>) -> ([&[f32]; 2], &mut [f32]) {
        for (copy, channel) in self.copy.iter_mut().zip(channels) {
            copy[..span.len()].copy_from_slice(&channel[span.clone()]);
        }
        let [first, second] = &self.copy;
        ([&first[..span.len()], &second[..span.len()]], &mut self.nowhere[..span.len()])
    }

    /// Plays the standalone program's file in place of the input. Returns its time, seconds, and whether it plays.
    #[cfg(feature = "standalone")]
    pub(super) fn play_file(&mut self, buffer: &mut Buffer) -> Option<(f64, bool)> {
        let [left, right, ..] = buffer.as_slice() else { return None };
        self.playhead.play(crate::playing::player::player()?, left, right)
    }

    #[cfg(not(feature = "standalone"))]
    #[expect(clippy::unused_self, reason = "hosts have their own files")]
    pub(super) fn play_file(&mut self, _buffer: &mut Buffer) -> Option<(f64, bool)> {
        None
    }
}
