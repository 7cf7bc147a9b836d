//! Who says the transfer function of a pose: a field, or an anchor cloud whose poses are decoded live.

pub(crate) mod cloud;
pub(crate) mod field;
pub(crate) mod follow;
pub(crate) mod live;
pub(crate) mod readout;

pub use cloud::{CloudDecoder, InlineWorker};
pub use field::{Axis, Basis, Facing, Field, FieldGrid, LowRank, NEAREST_M, Rows, SILENT_DB};
pub use live::{DecodeWorker, Decoded, LiveParams, PublishedFrame};
pub use readout::{MAX_LOG_COEFFICIENT, QueryValues, Readout};
