//! Decoders: from a pose to its transfer function, out of a field's table or from an anchor cloud, decoded live.

pub(crate) mod cloud;
pub(crate) mod field;
pub(crate) mod follow;
pub(crate) mod live;
pub(crate) mod readout;
pub(crate) mod sites;

use crate::{Pose, TransferFunction};
use std::ops::Range;

pub use cloud::{CloudDecoder, InlineWorker};
pub use field::{Axis, Basis, Facing, Field, FieldGrid, LowRank, NEAREST_M, Rows, SILENT_DB};
pub use live::{DecodeWorker, Decoded, PublishedFrame};
pub use readout::{MAX_LOG_COEFFICIENT, QueryValues, Readout};

/// How often poses are decoded while the listener moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiveParams {
    /// Decodes a second, above 0; answers are cross-faded over the time from one to the next.
    pub rate_hz: f32,
    /// Wait for every decode, as offline: the sound does not depend on the machine then.
    pub wait: bool,
}

impl Default for LiveParams {
    fn default() -> Self {
        Self { rate_hz: 40.0, wait: false }
    }
}

/// From a pose to its transfer function, hop by hop.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
pub(crate) trait Decoder {
    /// Moves on by a hop towards `pose`, or to it at once if `whole`. Returns whether the transfer function has changed.
    fn follow(&mut self, pose: &Pose, whole: bool, params: &LiveParams) -> bool;

    /// Brings some hops of the time filters up to date.
    fn update_filters(&mut self, change: &Change);

    /// The transfer function that is heard now.
    fn transfer(&self) -> &TransferFunction;
}

/// What has changed in a transfer function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Change {
    /// Masks, phase and interaural delay of the direct sound.
    pub(crate) direct: bool,
    /// Time filters, in bins above [`QUICK_BELOW_HZ`]: early explicit taps, then all others; none may be missing there for
    /// long.
    pub(crate) filters: [Hops; 2],
    /// The group of these bins whose turn it is, 0 to [`TURNS`]; all of them where there is none.
    pub(crate) turn: Option<usize>,
    /// Explicit taps below [`QUICK_BELOW_HZ`]: early ones, then later ones.
    pub(crate) quick: [Hops; 2],
}

impl Change {
    /// All of the direct sound, `filter_hops` time filters and explicit taps among them.
    pub(crate) fn whole(filter_hops: usize, taps: usize) -> Self {
        let all = |hops| [Hops::default(), Hops::all(hops)];
        Self { direct: true, filters: all(filter_hops), turn: None, quick: all(taps) }
    }

    /// Whether it leaves all time filters as they are.
    pub(crate) fn keeps_filters(&self) -> bool {
        [self.filters, self.quick] == <[[Hops; 2]; 2]>::default()
    }

    /// Blocks of bins in which a tap is to be brought up to date, of those that follow a pose quickly and of the others.
    pub(crate) fn blocks_of(
        &self,
        tap: usize,
        quick: &Range<usize>,
        slow: &Range<usize>,
    ) -> impl Iterator<Item = Range<usize>> {
        let is_due = |hops: &[Hops; 2]| hops.iter().any(|hops| hops.contains(tap));
        let blocks = [(is_due(&self.quick), quick.clone()), (is_due(&self.filters), self.group(slow))];
        blocks.into_iter().filter(|(is_due, _)| *is_due).map(|(_, blocks)| blocks)
    }

    /// The part of some blocks of bins whose turn it is, or all of them.
    pub(crate) fn group(&self, blocks: &Range<usize>) -> Range<usize> {
        self.turn.map_or_else(|| blocks.clone(), |turn| group(blocks, turn))
    }

    /// Whether an explicit tap is to be brought up to date, in whatever bins.
    pub(crate) fn names_tap(&self, tap: usize) -> bool {
        self.filters.iter().chain(&self.quick).any(|hops| hops.contains(tap))
    }
}

/// Groups of bins above [`QUICK_BELOW_HZ`], which are brought to a pose in turns, one at each hop: between its turns, the
/// filters of a group stay.
pub(crate) const TURNS: usize = 4;

/// The part of some blocks of bins whose turn it is.
pub(crate) fn group(blocks: &Range<usize>, turn: usize) -> Range<usize> {
    let at = |turn: usize| blocks.start + turn * blocks.len() / TURNS;
    at(turn)..at(turn + 1)
}

/// Below this frequency the taps follow a pose more often, Hz. A step of a filter makes sidebands some 100 Hz away: in a
/// critical band up there, but beside it below.
pub(crate) const QUICK_BELOW_HZ: f64 = 4000.0;

/// Hops of the time filters: explicit taps, then hops of the late part, then of the bass; every so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Hops {
    pub(crate) first: usize,
    pub(crate) end: usize,
    /// From one hop to the next.
    pub(crate) step: usize,
}

impl Hops {
    /// All of them, `count` in number.
    pub(crate) fn all(count: usize) -> Self {
        Self { first: 0, end: count, step: 1 }
    }

    pub(crate) fn contains(self, hop: usize) -> bool {
        (self.first..self.end).contains(&hop) && (hop - self.first).is_multiple_of(self.step)
    }

    pub(crate) fn iter(self) -> impl Iterator<Item = usize> {
        (self.first..self.end).filter(move |hop| self.contains(*hop))
    }
}
