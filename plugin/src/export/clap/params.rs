//! The framework's parameters, with what it cannot say of them: that a turn beyond the end of the range goes on at the other
//! end. Values between blocks reach the parameters without a task for each.

use super::values::changes;
use super::{Tables, framework_extension, hosted, parameter_of};
use crate::export::guard::guard;
use crate::parameter::Parameter;
use clap_sys::events::{clap_input_events, clap_output_events};
use clap_sys::ext::params::{CLAP_EXT_PARAMS, CLAP_PARAM_IS_PERIODIC, clap_param_info, clap_plugin_params};
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::CStr;

/// Name of the extension.
pub(super) const ID: &CStr = CLAP_EXT_PARAMS;

static TABLES: Tables<clap_plugin_params> = Tables::new();

/// The extension, if the framework has one.
pub(super) fn extension(plugin: *const clap_plugin) -> Option<&'static clap_plugin_params> {
    let theirs = framework_extension::<clap_plugin_params>(plugin, ID)?;
    TABLES.of(plugin, || clap_plugin_params { get_info: Some(get_info), flush: Some(flush), ..*theirs })
}

unsafe extern "C" fn get_info(plugin: *const clap_plugin, index: u32, info: *mut clap_param_info) -> bool {
    let theirs = framework_extension::<clap_plugin_params>(plugin, ID);
    let Some(get_info) = theirs.and_then(|theirs| theirs.get_info) else { return false };
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let known = unsafe { get_info(plugin, index, info) };
    // SAFETY: the framework has filled it in.
    if let Some(info) = unsafe { info.as_mut() }.filter(|_| known)
        && parameter_of(info.id).is_some_and(Parameter::is_periodic)
    {
        info.flags |= CLAP_PARAM_IS_PERIODIC;
    }
    known
}

/// Takes over values between blocks.
unsafe extern "C" fn flush(plugin: *const clap_plugin, events: *const clap_input_events, out: *const clap_output_events) {
    guard((), || {
        // SAFETY: the host hands over a list or none.
        if let (Some(hosted), Some(events)) = (hosted(plugin), unsafe { events.as_ref() }) {
            let values = &hosted.side.values;
            // SAFETY: the list lives through the call.
            unsafe { changes(values, events) }.for_each(|(_, id, change)| values.change(id, change));
        }
    });
    let theirs = framework_extension::<clap_plugin_params>(plugin, ID);
    if let Some(flush) = theirs.and_then(|theirs| theirs.flush) {
        // SAFETY: the plugin is the framework's; it takes no list for an empty one.
        unsafe { flush(plugin, std::ptr::null(), out) };
    }
}
