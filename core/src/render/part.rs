//! Parts of a voice that not every scene or latency has.

use crate::render::head::bus::AmbisonicBus;
use crate::render::transform::lanes::EarBlocks;
use crate::{Pose, PublishedFrame, Trim};
use std::ops::Range;

/// Portions of what is worked out before a hop is there.
pub(crate) const PORTIONS: usize = 16;

/// What a hop of a voice is played with.
#[derive(Clone, Copy)]
pub(crate) struct Hop<'a> {
    /// The listener's poses where it begins and where it ends.
    pub(crate) from: Pose,
    pub(crate) to: Pose,
    pub(crate) trim: Trim,
    /// The filter of the hops that do not wait for a frame, where it is another than before.
    pub(crate) filter: Option<&'a [EarBlocks]>,
}

/// Where parts add what is heard of them.
pub(crate) struct Heard<'a> {
    /// Both ears of the samples that are taken.
    pub(crate) ears: [&'a mut [f32]; 2],
    /// Where moving arrivals are added up.
    pub(crate) images: &'a mut AmbisonicBus,
}

/// A part of a voice.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
pub(crate) trait Part: Send {
    /// Begins a hop.
    fn begin(&mut self, _hop: &Hop<'_>) {}

    /// Works out a portion of what is heard of a hop that has begun and needs nothing of its samples, each of [`PORTIONS`] in
    /// turn.
    fn prepare(&mut self, _portion: usize, _heard: &mut Heard<'_>) {}

    /// Forgets what was worked out so.
    fn forget_prepared(&mut self) {}

    /// Takes samples of the hop that lie in one block of the pace, adds what is heard of them, and leaves what the parts after
    /// it are to hear.
    fn take(&mut self, hop: &mut [f32], span: Range<usize>, heard: &mut Heard<'_>);

    /// Has the last word on a hop of both ears; `published` is what the published head takes.
    fn finish(&mut self, _published: Option<&PublishedFrame>, _ears: &mut [Vec<f32>; 2]) {}

    /// Samples for which it sounds on after the input has ended.
    fn tail_samples(&self) -> usize {
        0
    }

    /// Is as new again.
    fn reset(&mut self);

    /// Bytes of its own.
    fn memory_bytes(&self) -> usize;
}
