//! A plugin's processing as VST3 hosts see it: its Ambisonic outputs are called what they are, tail and latency are known when
//! hosts ask, all inputs of further sources arrive, and values reach the parameters without a task for each.
//!
//! The framework makes up arrangements of speakers for 4, 9 and 16 channels, and hosts that compare what they asked for with
//! what they got refuse them. Its tail is what the last block said: none before the first, and none in silence.

use super::{block_room::BlockRoom, further_buses::Buses, hosted::table};
use crate::export::guard::guard;
use crate::parameter::cast::narrow;
use crate::project::host_values::Change;
use crate::worker::lock::{lock, try_lock};
use nice_plug::wrapper::vst3::vst3::ComRef;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    BusDirection, BusDirections_, IAudioProcessor, IAudioProcessorVtbl, IParamValueQueueTrait, IParameterChanges,
    IParameterChangesTrait, ProcessData, ProcessModes_, ProcessSetup, SpeakerArr, SpeakerArrangement,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{TBool, kInvalidArgument, kResultFalse, kResultOk, tresult};

/// Puts our functions into a processor's table.
pub(super) fn amend(ours: &mut IAudioProcessorVtbl) {
    *ours = IAudioProcessorVtbl {
        setBusArrangements: set_bus_arrangements,
        getBusArrangement: get_bus_arrangement,
        getTailSamples: get_tail_samples,
        getLatencySamples: get_latency_samples,
        setupProcessing: setup_processing,
        setProcessing: set_processing,
        process,
        ..*ours
    };
}

/// Hands a block on with all inputs, where and as the framework looks for them, and without values.
///
/// # Real-time
/// Audio thread; no allocation, lock or I/O.
unsafe extern "system" fn process(this: *mut IAudioProcessor, data: *mut ProcessData) -> tresult {
    guard(kResultFalse, || {
        let table = table(this);
        let hosted = table.hosted();
        // SAFETY: the host hands over a block or none.
        let Some(block) = (unsafe { data.as_ref() }) else { return kInvalidArgument };
        // No block is played beside another one, whatever the host does.
        let Some(mut room) = try_lock(&hosted.block).filter(|room| room.is_set_up) else { return kResultFalse };
        let BlockRoom { places, aside, was_offline, .. } = &mut *room;
        // Hosts say it with the setup, with each block, or with both, and change it in the one or the other.
        let is_offline = is_offline(block.processMode);
        if std::mem::replace(was_offline, is_offline) != is_offline {
            hosted.side.announce(is_offline);
        }
        let values = &hosted.side.values;
        hosted.controller.begin_block();
        // SAFETY: the host's lists live through the call.
        values.begin(u32::try_from(block.numSamples).unwrap_or(0), unsafe { changes(block) });
        let mut block = ProcessData { inputParameterChanges: places.list(), ..*block };
        // SAFETY: the plugin is the framework's; what it is handed lives through the call.
        let result = unsafe {
            match aside {
                Some(aside) => {
                    let mut buses = Buses::of(&block, aside);
                    let mut block = buses.handed_on(&block);
                    (table.theirs.process)(this, &raw mut block)
                }
                None => (table.theirs.process)(this, &raw mut block),
            }
        };
        values.end();
        hosted.controller.end_block();
        result
    })
}

/// Whether a mode of processing is that of a bounce.
fn is_offline(mode: i32) -> bool {
    mode == ProcessModes_::kOffline.cast_signed()
}

/// The changes of a block: sample, number and value.
///
/// # Safety
/// The block is as hosts hand it over.
unsafe fn changes(block: &ProcessData) -> impl Iterator<Item = (u32, u32, Change)> {
    // SAFETY: the host hands over a list or none, which gives out as many queues, each with as many points, as it says.
    let list = unsafe { ComRef::<IParameterChanges>::from_raw(block.inputParameterChanges) };
    let queues = list.into_iter().flat_map(|list| unsafe {
        (0..list.getParameterCount()).filter_map(move |place| ComRef::from_raw(list.getParameterData(place)))
    });
    queues.flat_map(|queue| {
        // SAFETY: as above.
        let (id, count) = unsafe { (queue.getParameterId(), queue.getPointCount()) };
        (0..count).filter_map(move |place| {
            let (mut sample, mut value) = (0, 0.0);
            // SAFETY: as above.
            let is_there = unsafe { queue.getPoint(place, &raw mut sample, &raw mut value) } == kResultOk;
            is_there.then(|| (u32::try_from(sample).unwrap_or(0), id, Change::Value(narrow(value))))
        })
    })
}

/// Takes over whether the host plays.
unsafe extern "system" fn set_processing(this: *mut IAudioProcessor, state: TBool) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (table.theirs.setProcessing)(this, state) };
    guard(result, || {
        let hosted = table.hosted();
        hosted.controller.play(&hosted.side, state != 0);
        result
    })
}

unsafe extern "system" fn get_tail_samples(this: *mut IAudioProcessor) -> u32 {
    table(this).hosted().side.tail()
}

unsafe extern "system" fn get_latency_samples(this: *mut IAudioProcessor) -> u32 {
    table(this).hosted().side.tell_latency()
}

/// Hosts may ask for latency and tail from here on, before any activation.
unsafe extern "system" fn setup_processing(this: *mut IAudioProcessor, setup: *mut ProcessSetup) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (table.theirs.setupProcessing)(this, setup) };
    // SAFETY: the host hands over a setup or none.
    let Some(setup) = unsafe { setup.as_ref() }.filter(|_| result == kResultOk) else { return result };
    guard(kResultFalse, || {
        let hosted = table.hosted();
        hosted.side.announce(is_offline(setup.processMode));
        let live_block = if is_offline(setup.processMode) { 0 } else { u32::try_from(setup.maxSamplesPerBlock).unwrap_or(0) };
        hosted.side.prepare(setup.sampleRate, live_block);
        let mut room = lock(&hosted.block);
        (room.is_set_up, room.was_offline) = (true, false);
        if let Some(aside) = &mut room.aside {
            aside.resize(setup.maxSamplesPerBlock);
        }
        result
    })
}

unsafe extern "system" fn set_bus_arrangements(
    this: *mut IAudioProcessor,
    inputs: *mut SpeakerArrangement,
    input_count: i32,
    outputs: *mut SpeakerArrangement,
    output_count: i32,
) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (table.theirs.setBusArrangements)(this, inputs, input_count, outputs, output_count) };
    // SAFETY: there is one for each output.
    if let Some(output) = unsafe { outputs.as_ref() }.filter(|_| result == kResultOk && output_count > 0) {
        *lock(&table.hosted().asked) = Some(*output);
    }
    result
}

unsafe extern "system" fn get_bus_arrangement(
    this: *mut IAudioProcessor,
    dir: BusDirection,
    index: i32,
    arr: *mut SpeakerArrangement,
) -> tresult {
    let table = table(this);
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (table.theirs.getBusArrangement)(this, dir, index, arr) };
    let is_output = i64::from(dir) == i64::from(BusDirections_::kOutput);
    // SAFETY: the framework has filled it in.
    if let Some(arr) = unsafe { arr.as_mut() }.filter(|_| result == kResultOk && is_output) {
        let count = arr.count_ones();
        let asked = lock(&table.hosted().asked).filter(|asked| asked.count_ones() == count);
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
