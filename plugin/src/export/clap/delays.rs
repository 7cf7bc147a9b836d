//! How late the sound is and how long it sounds on: `clap.latency` and `clap.tail`.
//!
//! The framework asks for another activation as soon as an activation has another latency than the one before, though the host
//! reads it then anyway. Its tail is what the last block said: a host that asks before it bounces, or in silence, hears of none
//! and cuts the sound.

use super::{host_extension, hosted};
use crate::telemetry::host_side::HostCalls;
use clap_sys::ext::latency::{CLAP_EXT_LATENCY, clap_host_latency, clap_plugin_latency};
use clap_sys::ext::tail::{CLAP_EXT_TAIL, clap_host_tail, clap_plugin_tail};
use nice_plug::wrapper::clap::{clap_host, clap_plugin};

/// The extensions.
pub(super) static LATENCY: clap_plugin_latency = clap_plugin_latency { get: Some(latency) };
pub(super) static TAIL: clap_plugin_tail = clap_plugin_tail { get: Some(tail) };

/// Main thread.
unsafe extern "C" fn latency(plugin: *const clap_plugin) -> u32 {
    hosted(plugin).map_or(0, |hosted| hosted.side.latency())
}

/// Main and audio thread.
unsafe extern "C" fn tail(plugin: *const clap_plugin) -> u32 {
    hosted(plugin).map_or(0, |hosted| hosted.side.tail())
}

/// Tells the host that there is another latency or tail; nothing where it does not want to know.
pub(super) fn calls(plugin: *const clap_plugin) -> HostCalls {
    let latency = host_extension::<clap_host_latency>(plugin, &[CLAP_EXT_LATENCY]);
    let tail = host_extension::<clap_host_tail>(plugin, &[CLAP_EXT_TAIL]);
    HostCalls {
        latency_changed: call(latency.and_then(|(host, theirs)| Some((host, theirs.changed?)))),
        tail_changed: call(tail.and_then(|(host, theirs)| Some((host, theirs.changed?)))),
    }
}

fn call(known: Option<(*const clap_host, unsafe extern "C" fn(*const clap_host))>) -> Box<dyn Fn() + Send + Sync> {
    let known = known.map(|(host, changed)| (host.expose_provenance(), changed));
    Box::new(move || {
        if let Some((host, changed)) = known {
            // SAFETY: hosts outlive their plugins, and so do their tables of functions.
            unsafe { changed(std::ptr::with_exposed_provenance(host)) };
        }
    })
}
