//! Values that a host has set on a controller, until a block brings them.

use crate::project::host_values::Change;
use crate::telemetry::host_side::HostSide;
use crate::worker::lock::lock;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::ParamID;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// What a host has set on a controller while it said that it plays.
#[derive(Default)]
pub(super) struct ControllerValues {
    /// By number: a share of the range, and how many blocks had begun.
    held: Mutex<BTreeMap<ParamID, (f32, u32)>>,
    /// Whether the host says that it plays; it may do so without a block.
    plays: AtomicBool,
    /// Blocks that have begun.
    begun: AtomicU32,
    /// Blocks that have ended.
    ended: AtomicU32,
}

impl ControllerValues {
    /// A block begins.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn begin_block(&self) {
        self.begun.fetch_add(1, Ordering::AcqRel);
    }

    /// A block ends: it has brought what was set before it began.
    ///
    /// # Real-time
    /// Audio thread; no allocation, lock or I/O.
    pub(super) fn end_block(&self) {
        self.ended.fetch_add(1, Ordering::AcqRel);
    }

    /// What no block has brought yet.
    pub(super) fn pending(&self) -> BTreeMap<ParamID, f32> {
        let ended = self.ended.load(Ordering::Acquire);
        let mut held = lock(&self.held);
        // The difference may go beyond the greatest number.
        held.retain(|_, (_, begun)| ended.wrapping_sub(*begun).cast_signed() <= 0);
        held.iter().map(|(id, (value, _))| (*id, *value)).collect()
    }

    /// Takes over whether the host plays; without blocks nothing else brings what was set.
    pub(super) fn play(&self, side: &HostSide, plays: bool) {
        self.plays.store(plays, Ordering::Release);
        if !plays {
            self.pending().into_iter().for_each(|(id, share)| side.values.change(id, Change::Value(share)));
            lock(&self.held).clear();
        }
    }

    /// Holds a value until a block that begins later has ended, if blocks come; says whether it does.
    pub(super) fn hold(&self, id: ParamID, share: f32) -> bool {
        let plays = self.plays.load(Ordering::Acquire);
        if plays {
            lock(&self.held).insert(id, (share, self.begun.load(Ordering::Acquire)));
        }
        plays
    }

    /// Forgets what is held.
    pub(super) fn clear(&self) {
        lock(&self.held).clear();
    }
}
