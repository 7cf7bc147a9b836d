//! The inputs of further sources, as the framework takes them: it reads one more than a host hands over, and takes every
//! pointer that a host has for granted.

use super::Hosted;
use crate::export::silence;
use crate::parameter::source_knob::MOST_INPUTS;
use clap_sys::audio_buffer::clap_audio_buffer;
use clap_sys::process::clap_process;
use nice_plug::wrapper::clap::clap_plugin;

/// Hands a block on with so many inputs: those that the host does not feed are silent.
///
/// # Safety
/// The block is as hosts hand it over.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
pub(super) unsafe fn process(hosted: &Hosted, plugin: *const clap_plugin, block: &clap_process, wanted: usize) -> i32 {
    let silent = clap_audio_buffer {
        data32: silence::channel(block.frames_count as usize),
        data64: std::ptr::null_mut(),
        channel_count: 1,
        latency: 0,
        constant_mask: 1,
    };
    let mut inputs = [silent; MOST_INPUTS];
    let count = if block.audio_inputs.is_null() { 0 } else { block.audio_inputs_count as usize };
    for (number, input) in inputs.iter_mut().enumerate().take(count.min(wanted)) {
        // SAFETY: there are so many, each with a list of so many channels or without one.
        unsafe {
            let theirs = *block.audio_inputs.add(number);
            if theirs.channel_count > 0 && !theirs.data32.is_null() && !(*theirs.data32).is_null() {
                // Of more channels than one the framework takes the first.
                *input = clap_audio_buffer { channel_count: 1, ..theirs };
            }
        }
    }
    let block =
        clap_process { audio_inputs: inputs.as_ptr(), audio_inputs_count: u32::try_from(wanted).unwrap_or(0), ..*block };
    // SAFETY: the plugin is the framework's; what it is handed lives through the call.
    unsafe { (hosted.theirs.process)(plugin, &raw const block) }
}
