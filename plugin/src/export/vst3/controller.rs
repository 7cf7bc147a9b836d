//! A plugin's values as VST3 hosts see them on its controller.
//!
//! Hosts set a value there, and hand it to the processor with the next block. The framework ignores the first while it thinks
//! that blocks come: until then it reports the old value, and saves it. Here the host reads what it has set.

use super::hosted::{Hosted, table};
use super::stream::Written;
use crate::export::guard::guard;
use crate::parameter::cast::narrow;
use crate::project::host_values::Change;
use crate::worker::lock::lock;
use nice_plug::plugin::PluginState;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    IComponent, IComponentVtbl, IEditController, IEditControllerVtbl, ParamID, ParamValue,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{IBStream, kInvalidArgument, kResultFalse, kResultOk, tresult};
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
    fn pending(&self) -> BTreeMap<ParamID, f32> {
        let ended = self.ended.load(Ordering::Acquire);
        let mut held = lock(&self.held);
        // The difference may go beyond the greatest number.
        held.retain(|_, (_, begun)| ended.wrapping_sub(*begun).cast_signed() <= 0);
        held.iter().map(|(id, (value, _))| (*id, *value)).collect()
    }

    /// Takes over whether the host plays; without blocks nothing else brings what was set.
    pub(super) fn play(&self, hosted: &Hosted, plays: bool) {
        self.plays.store(plays, Ordering::Release);
        if !plays {
            self.pending().into_iter().for_each(|(id, share)| hosted.side.values.change(id, Change::Value(share)));
            lock(&self.held).clear();
        }
    }
}

/// Puts our functions into a component's table.
pub(super) fn amend_component(ours: &mut IComponentVtbl) {
    (ours.getState, ours.setState) = (get_state, set_state);
}

/// Puts our functions into a controller's table.
pub(super) fn amend_controller(ours: &mut IEditControllerVtbl) {
    (ours.getParamNormalized, ours.setParamNormalized) = (get_param_normalized, set_param_normalized);
}

#[expect(unsafe_code, reason = "the signature is VST3's")]
unsafe extern "system" fn set_param_normalized(this: *mut IEditController, id: ParamID, value: ParamValue) -> tresult {
    guard(kResultFalse, || {
        let Hosted { side, controller, .. } = table(this).hosted();
        let landed = side.values.landed(id, narrow(value)).filter(|share| share.is_finite());
        let Some(share) = landed else { return kInvalidArgument };
        if controller.plays.load(Ordering::Acquire) {
            lock(&controller.held).insert(id, (share, controller.begun.load(Ordering::Acquire)));
        } else {
            side.values.change(id, Change::Value(share));
        }
        kResultOk
    })
}

#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn get_param_normalized(this: *mut IEditController, id: ParamID) -> ParamValue {
    let table = table(this);
    let pending = guard(None, || table.hosted().controller.pending().get(&id).copied());
    // SAFETY: the plugin is the framework's.
    pending.map_or_else(|| unsafe { (table.theirs.getParamNormalized)(this, id) }, ParamValue::from)
}

/// The framework's state, with what the host has set and no block has brought yet.
#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn get_state(this: *mut IComponent, stream: *mut IBStream) -> tresult {
    let table = table(this);
    let hosted = table.hosted();
    let pending = guard(BTreeMap::new(), || hosted.controller.pending());
    if pending.is_empty() {
        // SAFETY: the plugin is the framework's, and the host's argument is handed on.
        return unsafe { (table.theirs.getState)(this, stream) };
    }
    guard(kResultFalse, || {
        let written = Written::default();
        // SAFETY: as above; the stream lives through the call.
        let bytes = written.by(|stream| unsafe { (table.theirs.getState)(this, stream) } == kResultOk);
        let saved = bytes.and_then(|bytes| serde_json::from_slice::<PluginState>(&bytes).ok());
        let Some(mut state) = saved else { return kResultFalse };
        let saved = pending.into_iter().filter_map(|(id, share)| hosted.side.values.saved(id, share));
        state.params.extend(saved.map(|(id, value)| (id.to_owned(), value)));
        let json = serde_json::to_vec(&state).unwrap_or_default();
        // SAFETY: the host hands over a stream or none.
        unsafe { super::stream::write(stream, &json) }
    })
}

#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn set_state(this: *mut IComponent, stream: *mut IBStream) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (table.theirs.setState)(this, stream) };
    if result == kResultOk {
        lock(&table.hosted().controller.held).clear();
    }
    result
}
