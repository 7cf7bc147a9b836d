//! Decoders: from a pose to its transfer function, out of a field's table or from an anchor cloud, decoded live.

pub(crate) mod cloud;
pub(crate) mod field;
pub(crate) mod follow;
pub(crate) mod live;
pub(crate) mod readout;

use crate::{LiveParams, Pose, TransferFunction};
use std::ops::Range;

pub use cloud::{CloudDecoder, InlineWorker};
pub use field::{Axis, Basis, Facing, Field, FieldGrid, LowRank, NEAREST_M, Rows, SILENT_DB};
pub use live::{DecodeWorker, Decoded, PublishedFrame};
pub use readout::{MAX_LOG_COEFFICIENT, QueryValues, Readout};

/// From a pose to its transfer function, hop by hop.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
pub(crate) trait Decoder {
    /// Moves on by a hop towards `pose`, or to it at once if `whole`. Returns whether the transfer function has changed.
    fn follow(&mut self, pose: &Pose, whole: bool, params: &LiveParams) -> bool;

    /// Brings a range of the time filters up to date: explicit taps, then hops of the late part.
    fn update_filters(&mut self, hops: Range<usize>);

    /// The transfer function that is heard now.
    fn transfer(&self) -> &TransferFunction;
}

/// What has changed in a transfer function.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Change {
    /// Masks, phase and interaural delay of the direct sound.
    pub(crate) direct: bool,
    /// Time filters: explicit taps, then hops of the late part.
    pub(crate) filters: Range<usize>,
}
