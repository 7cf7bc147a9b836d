//! The state of an instance by the framework's own `clap.state`: its length, 8 bytes with the least significant first, and
//! JSON.

use super::framework_extension;
use clap_sys::ext::state::{CLAP_EXT_STATE, clap_plugin_state};
use clap_sys::stream::{clap_istream, clap_ostream};
use nice_plug::plugin::PluginState;
use nice_plug::wrapper::clap::clap_plugin;
use std::ffi::c_void;

/// Bytes before the JSON.
const LENGTH: usize = 8;

/// The state as it is saved. Main thread.
pub(super) fn save(plugin: *const clap_plugin) -> Option<PluginState> {
    let save = framework_extension::<clap_plugin_state>(plugin, CLAP_EXT_STATE)?.save?;
    let mut bytes: Vec<u8> = Vec::new();
    let stream = clap_ostream { ctx: (&raw mut bytes).cast(), write: Some(write) };
    // SAFETY: plugin and stream live through the call, and the stream's context is what `write` takes it for.
    let saved = unsafe { save(plugin, &raw const stream) };
    if saved { serde_json::from_slice(bytes.get(LENGTH..)?).ok() } else { None }
}

/// Restores a state; says whether it was taken. Main thread.
pub(super) fn load(plugin: *const clap_plugin, state: &PluginState) -> bool {
    let extension = framework_extension::<clap_plugin_state>(plugin, CLAP_EXT_STATE);
    let (Some(load), Ok(json)) = (extension.and_then(|state| state.load), serde_json::to_vec(state)) else { return false };
    let bytes = [&(json.len() as u64).to_le_bytes(), &json[..]].concat();
    let mut rest = &bytes[..];
    let stream = clap_istream { ctx: (&raw mut rest).cast(), read: Some(read) };
    // SAFETY: plugin and stream live through the call, and the stream's context is what `read` takes it for.
    unsafe { load(plugin, &raw const stream) }
}

unsafe extern "C" fn write(stream: *const clap_ostream, buffer: *const c_void, size: u64) -> i64 {
    let Ok(size) = usize::try_from(size) else { return -1 };
    // SAFETY: `save` has made the stream; its caller hands over that many bytes.
    let (bytes, new) =
        unsafe { (&mut *(*stream).ctx.cast::<Vec<u8>>(), std::slice::from_raw_parts(buffer.cast::<u8>(), size)) };
    bytes.extend(new);
    i64::try_from(size).unwrap_or(-1)
}

unsafe extern "C" fn read(stream: *const clap_istream, buffer: *mut c_void, size: u64) -> i64 {
    // SAFETY: `load` has made the stream.
    let rest = unsafe { &mut *(*stream).ctx.cast::<&[u8]>() };
    let count = rest.len().min(usize::try_from(size).unwrap_or(usize::MAX));
    let (now, later) = rest.split_at(count);
    // SAFETY: the caller has room for `size` bytes, and these are at most as many.
    unsafe { std::ptr::copy_nonoverlapping(now.as_ptr(), buffer.cast::<u8>(), count) };
    *rest = later;
    i64::try_from(count).unwrap_or(-1)
}
