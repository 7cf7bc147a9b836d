//! A plugin's processing as hosts see it: its Ambisonic outputs are called what they are, tail and latency are known when hosts
//! ask, and all inputs of further sources arrive.
//!
//! The framework makes up arrangements of speakers for 4, 9 and 16 channels, and hosts that compare what they asked for with
//! what they got refuse them. Its tail is what the last block said: none before the first, and none in silence.

use super::further_buses::{Aside, Buses};
use crate::telemetry::host_side::HostSide;
use crate::worker::lock::lock;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    BusDirection, BusDirections_, IAudioProcessor, IAudioProcessorVtbl, ProcessData, ProcessSetup, SpeakerArr,
    SpeakerArrangement,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{kInvalidArgument, kResultOk, tresult};
use std::cell::UnsafeCell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};

/// The table of functions of one plugin, and what is known of the plugin.
#[repr(C)]
struct Amended {
    /// First, so that a pointer to it is one to the whole.
    ours: IAudioProcessorVtbl,
    /// The framework's own.
    theirs: IAudioProcessorVtbl,
    /// The arrangement of the main output that a host has asked for, and got.
    asked: Mutex<Option<SpeakerArrangement>>,
    side: Weak<HostSide>,
    /// Of a plugin with further sources.
    aside: Option<UnsafeCell<Aside>>,
}

/// That of a plugin, which keeps a pointer to it.
struct Table(*mut Amended);

#[expect(unsafe_code, reason = "a pointer is moved between threads")]
// SAFETY: what it points to may be moved between threads, and nobody else frees it.
unsafe impl Send for Table {}

/// Those of all plugins by their addresses. One is freed when another plugin is at its address, as its own is gone for certain.
static TABLES: Mutex<BTreeMap<usize, Table>> = Mutex::new(BTreeMap::new());

/// Lets a new plugin name its Ambisonic outputs, its tail and its latency, and hear the inputs of so many further
/// sources.
#[expect(unsafe_code, reason = "the framework's table of functions is changed")]
pub(super) fn amend(processor: *mut IAudioProcessor, side: Option<&Arc<HostSide>>, further: usize) {
    // SAFETY: the plugin is alive and nobody else knows it yet.
    let theirs = unsafe { *(*processor).vtbl };
    let ours = IAudioProcessorVtbl {
        setBusArrangements: set_bus_arrangements,
        getBusArrangement: get_bus_arrangement,
        getTailSamples: get_tail_samples,
        getLatencySamples: get_latency_samples,
        setupProcessing: setup_processing,
        process: if further > 0 { process } else { theirs.process },
        ..theirs
    };
    let side = side.map_or_else(Weak::new, Arc::downgrade);
    let aside = (further > 0).then(|| UnsafeCell::new(Aside::new(1 + further)));
    let table = Box::into_raw(Box::new(Amended { ours, theirs, asked: Mutex::default(), side, aside }));
    if let Some(Table(former)) = lock(&TABLES).insert(processor.addr(), Table(table)) {
        // SAFETY: it was made here, and the plugin that had it was where this one is.
        drop(unsafe { Box::from_raw(former) });
    }
    // SAFETY: as above; the table lives as long as the plugin.
    unsafe { (*processor).vtbl = table.cast::<IAudioProcessorVtbl>() };
}

/// What is known of a plugin.
#[expect(unsafe_code, reason = "a plugin's table of functions is read")]
fn amended<'a>(processor: *mut IAudioProcessor) -> &'a Amended {
    // SAFETY: hosts call these functions by the table that `amend` has put there, which lives as long as the plugin.
    unsafe { &*(*processor).vtbl.cast::<Amended>() }
}

/// What an instance shows of its host.
fn side_of(processor: *mut IAudioProcessor) -> Option<Arc<HostSide>> {
    amended(processor).side.upgrade()
}

/// Hands a block on with all inputs, where and as the framework looks for them.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn process(this: *mut IAudioProcessor, data: *mut ProcessData) -> tresult {
    let Amended { theirs, aside, .. } = amended(this);
    // SAFETY: the host hands over a block or none, and prepares no other one meanwhile; what the framework is handed lives
    // through the call.
    unsafe {
        let (Some(block), Some(aside)) = (data.as_ref(), aside) else { return kInvalidArgument };
        let mut buses = Buses::of(block, &mut *aside.get());
        let mut block = buses.handed_on(block);
        (theirs.process)(this, &raw mut block)
    }
}

#[expect(unsafe_code, reason = "the signature is VST3's")]
unsafe extern "system" fn get_tail_samples(this: *mut IAudioProcessor) -> u32 {
    side_of(this).map_or(0, |side| side.tail())
}

#[expect(unsafe_code, reason = "the signature is VST3's")]
unsafe extern "system" fn get_latency_samples(this: *mut IAudioProcessor) -> u32 {
    side_of(this).map_or(0, |side| side.tell_latency())
}

/// Hosts may ask for latency and tail from here on, before any activation.
#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn setup_processing(this: *mut IAudioProcessor, setup: *mut ProcessSetup) -> tresult {
    let Amended { theirs, .. } = amended(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (theirs.setupProcessing)(this, setup) };
    // SAFETY: the host hands over a setup or none.
    let Some(setup) = unsafe { setup.as_ref() }.filter(|_| result == kResultOk) else { return result };
    if let Some(side) = side_of(this) {
        side.prepare(setup.sampleRate);
    }
    if let Some(aside) = &amended(this).aside {
        // SAFETY: hosts play no block meanwhile.
        unsafe { (*aside.get()).resize(setup.maxSamplesPerBlock) };
    }
    result
}

#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn set_bus_arrangements(
    this: *mut IAudioProcessor,
    inputs: *mut SpeakerArrangement,
    input_count: i32,
    outputs: *mut SpeakerArrangement,
    output_count: i32,
) -> tresult {
    let Amended { theirs, .. } = amended(this);
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (theirs.setBusArrangements)(this, inputs, input_count, outputs, output_count) };
    // SAFETY: there is one for each output.
    if let Some(output) = unsafe { outputs.as_ref() }.filter(|_| result == kResultOk && output_count > 0) {
        *lock(&amended(this).asked) = Some(*output);
    }
    result
}

#[expect(unsafe_code, reason = "hosts hand over pointers")]
unsafe extern "system" fn get_bus_arrangement(
    this: *mut IAudioProcessor,
    dir: BusDirection,
    index: i32,
    arr: *mut SpeakerArrangement,
) -> tresult {
    let Amended { theirs, .. } = amended(this);
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (theirs.getBusArrangement)(this, dir, index, arr) };
    let is_output = i64::from(dir) == i64::from(BusDirections_::kOutput);
    // SAFETY: the framework has filled it in.
    if let Some(arr) = unsafe { arr.as_mut() }.filter(|_| result == kResultOk && is_output) {
        let count = arr.count_ones();
        let asked = lock(&amended(this).asked).filter(|asked| asked.count_ones() == count);
        // As the format calls them, where no host has asked for other names.
        *arr = asked.unwrap_or(match count {
            4 => SpeakerArr::kAmbi1stOrderACN,
            9 => SpeakerArr::kAmbi2cdOrderACN,
            16 => SpeakerArr::kAmbi3rdOrderACN,
            _ => *arr,
        });
    }
    result
}
