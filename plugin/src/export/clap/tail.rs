//! How long the plugin sounds on: `clap.tail`. The framework's own answer is what the last block said, so that a host which
//! asks before it bounces, or in silence, hears of no tail and cuts the sound.

use super::{host_extension, hosted};
use clap_sys::ext::tail::{CLAP_EXT_TAIL, clap_host_tail, clap_plugin_tail};
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::CStr;

/// Name of the extension.
pub(super) const ID: &CStr = CLAP_EXT_TAIL;

/// The extension.
pub(super) static EXTENSION: clap_plugin_tail = clap_plugin_tail { get: Some(get) };

/// Main and audio thread.
#[expect(unsafe_code, reason = "the signature is CLAP's")]
unsafe extern "C" fn get(plugin: *const clap_plugin) -> u32 {
    hosted(plugin).map_or(0, |hosted| hosted.side.tail())
}

/// Tells the host that there is another tail; nothing where it does not want to know.
#[expect(unsafe_code, reason = "the host is asked through its table of functions")]
pub(super) fn changed(plugin: *const clap_plugin) -> impl Fn() + Send + Sync + 'static {
    let known = host_extension::<clap_host_tail>(plugin, &[ID]);
    let call = known.and_then(|(host, theirs)| Some((host.expose_provenance(), theirs.changed?)));
    move || {
        if let Some((host, changed)) = call {
            // SAFETY: hosts outlive their plugins, and so do their tables of functions.
            unsafe { changed(std::ptr::with_exposed_provenance(host)) };
        }
    }
}
