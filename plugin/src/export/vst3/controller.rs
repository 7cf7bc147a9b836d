//! A plugin's values as VST3 hosts see them on its controller.
//!
//! Hosts set a value there, and hand it to the processor with the next block. The framework ignores the first while it thinks
//! that blocks come: until then it reports the old value, and saves it. Here the host reads what it has set.

use super::hosted::{Hosted, table};
use super::{stream::Written, view::create_view};
use crate::export::guard::guard;
use crate::parameter::cast::narrow;
use crate::project::host_values::Change;
use nice_plug::plugin::PluginState;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    IComponent, IComponentVtbl, IEditController, IEditControllerVtbl, ParamID, ParamValue,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{IBStream, kInvalidArgument, kResultFalse, kResultOk, tresult};
use std::collections::BTreeMap;

/// Puts our functions into a component's table.
pub(super) fn amend_component(ours: &mut IComponentVtbl) {
    (ours.getState, ours.setState) = (get_state, set_state);
}

/// Puts our functions into a controller's table.
pub(super) fn amend_controller(ours: &mut IEditControllerVtbl) {
    (ours.getParamNormalized, ours.setParamNormalized) = (get_param_normalized, set_param_normalized);
    ours.createView = create_view;
}

unsafe extern "system" fn set_param_normalized(this: *mut IEditController, id: ParamID, value: ParamValue) -> tresult {
    guard(kResultFalse, || {
        let Hosted { side, controller, .. } = table(this).hosted();
        let landed = side.values.landed(id, narrow(value)).filter(|share| share.is_finite());
        let Some(share) = landed else { return kInvalidArgument };
        if !controller.hold(id, share) {
            side.values.change(id, Change::Value(share));
        }
        kResultOk
    })
}

unsafe extern "system" fn get_param_normalized(this: *mut IEditController, id: ParamID) -> ParamValue {
    let table = table(this);
    let pending = guard(None, || table.hosted().controller.pending().get(&id).copied());
    // SAFETY: the plugin is the framework's.
    pending.map_or_else(|| unsafe { (table.theirs.getParamNormalized)(this, id) }, ParamValue::from)
}

/// The framework's state, with what the host has set and no block has brought yet.
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

unsafe extern "system" fn set_state(this: *mut IComponent, stream: *mut IBStream) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (table.theirs.setState)(this, stream) };
    if result == kResultOk {
        table.hosted().controller.clear();
    }
    result
}
