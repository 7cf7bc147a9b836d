//! How late the sound is: `clap.latency`. The framework asks for another activation as soon as an activation has another
//! latency than the one before, though the host reads it then anyway.

use super::{host_extension, hosted};
use clap_sys::ext::latency::{CLAP_EXT_LATENCY, clap_host_latency, clap_plugin_latency};
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::CStr;

/// Name of the extension.
pub(super) const ID: &CStr = CLAP_EXT_LATENCY;

/// The extension.
pub(super) static EXTENSION: clap_plugin_latency = clap_plugin_latency { get: Some(get) };

/// Main thread.
#[expect(unsafe_code, reason = "the signature is CLAP's")]
unsafe extern "C" fn get(plugin: *const clap_plugin) -> u32 {
    hosted(plugin).map_or(0, |hosted| hosted.side.latency())
}

/// Tells the host that there is another latency; nothing where it does not want to know.
#[expect(unsafe_code, reason = "the host is asked through its table of functions")]
pub(super) fn changed(plugin: *const clap_plugin) -> impl Fn() + Send + Sync + 'static {
    let known = host_extension::<clap_host_latency>(plugin, &[ID]);
    let call = known.and_then(|(host, theirs)| Some((host.expose_provenance(), theirs.changed?)));
    move || {
        if let Some((host, changed)) = call {
            // SAFETY: hosts outlive their plugins, and so do their tables of functions.
            unsafe { changed(std::ptr::with_exposed_provenance(host)) };
        }
    }
}
