//! Room for playing a block.

use super::{further_buses::Aside, places::Places};
use crate::telemetry::host_side::HostSide;
use std::sync::Arc;

/// What is needed while a block is played.
pub(super) struct BlockRoom {
    /// Where the block is split.
    pub(super) places: Places,
    /// Of a plugin with further sources.
    pub(super) aside: Option<Aside>,
    /// Whether hosts have said how blocks are: before, the framework ends them for a block.
    pub(super) is_set_up: bool,
    /// Whether the last block since then was offline by its own mode.
    pub(super) was_offline: bool,
}

impl BlockRoom {
    /// Of an instance with so many further sources, which shows this of its host.
    pub(super) fn new(side: &Arc<HostSide>, further: usize) -> Option<Self> {
        let aside = (further > 0).then(|| Aside::new(1 + further));
        Some(Self { places: Places::of(side)?, aside, is_set_up: false, was_offline: false })
    }
}
