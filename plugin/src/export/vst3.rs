//! The VST3 entry: the framework's plugin, whose Ambisonic outputs are called what they are, and whose tail and latency are
//! known when hosts ask.
//!
//! The framework's own entry makes up arrangements of speakers for 4, 9 and 16 channels, and hosts that compare what they asked
//! for with what they got refuse them. Its tail is what the last block said: none before the first, and none in silence.

use crate::export::plugin::Promenade;
use crate::telemetry::host_side::HostSide;
use crate::worker::lock::lock;
use nice_plug::wrapper::setup_logger;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::{
    BusDirection, BusDirections_, IAudioProcessor, IAudioProcessorVtbl, ProcessSetup, SpeakerArr, SpeakerArrangement,
};
use nice_plug::wrapper::vst3::vst3::Steinberg::{
    FIDString, FUnknown, IPluginFactory, IPluginFactory2, IPluginFactory2Trait, IPluginFactory3, IPluginFactory3Trait,
    IPluginFactoryTrait, PClassInfo, PClassInfo2, PClassInfoW, PFactoryInfo, TUID, kInvalidArgument, kResultOk, tresult,
};
use nice_plug::wrapper::vst3::vst3::{Class, ComWrapper};
use nice_plug::wrapper::vst3::{PluginInfo, Wrapper};
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// Makes the only plugin.
struct Factory(PluginInfo);

impl Class for Factory {
    type Interfaces = (IPluginFactory, IPluginFactory2, IPluginFactory3);
}

/// Fills in what a host asks of the class of a number, which is the first.
#[expect(unsafe_code, reason = "hosts hand over pointers")]
fn fill<T>(number: i32, info: *mut T, make: impl FnOnce() -> T) -> tresult {
    // SAFETY: the host hands over room for it or none.
    match unsafe { info.as_mut() } {
        Some(info) if number == 0 => {
            *info = make();
            kResultOk
        }
        _ => kInvalidArgument,
    }
}

#[expect(unsafe_code, reason = "the signatures are VST3's")]
impl IPluginFactoryTrait for Factory {
    unsafe fn getFactoryInfo(&self, info: *mut PFactoryInfo) -> tresult {
        fill(0, info, || self.0.create_factory_info())
    }

    unsafe fn countClasses(&self) -> i32 {
        1
    }

    unsafe fn getClassInfo(&self, index: i32, info: *mut PClassInfo) -> tresult {
        fill(index, info, || self.0.create_class_info())
    }

    unsafe fn createInstance(&self, cid: FIDString, iid: FIDString, obj: *mut *mut c_void) -> tresult {
        // SAFETY: the host hands over a class's number or none.
        let wanted = unsafe { cid.cast::<[u8; 16]>().as_ref() };
        if obj.is_null() || iid.is_null() || wanted != Some(self.0.cid) {
            return kInvalidArgument;
        }
        let plugin = ComWrapper::new(Wrapper::<Promenade>::new());
        let side = HostSide::newborn();
        if let Some(processor) = plugin.as_com_ref::<IAudioProcessor>() {
            amend(processor.as_ptr(), side.as_ref());
        }
        let Some(unknown) = plugin.as_com_ref::<FUnknown>() else { return kInvalidArgument };
        // SAFETY: the plugin is alive; the host hands over an interface's number and room for the plugin, which has a reference
        // more then.
        unsafe { ((*(*unknown.as_ptr()).vtbl).queryInterface)(unknown.as_ptr(), iid.cast::<TUID>(), obj) }
    }
}

#[expect(unsafe_code, reason = "the signatures are VST3's")]
impl IPluginFactory2Trait for Factory {
    unsafe fn getClassInfo2(&self, index: i32, info: *mut PClassInfo2) -> tresult {
        fill(index, info, || self.0.create_class_info_2())
    }
}

#[expect(unsafe_code, reason = "the signatures are VST3's")]
impl IPluginFactory3Trait for Factory {
    unsafe fn getClassInfoUnicode(&self, index: i32, info: *mut PClassInfoW) -> tresult {
        fill(index, info, || self.0.create_class_info_unicode())
    }

    unsafe fn setHostContext(&self, _context: *mut FUnknown) -> tresult {
        kResultOk
    }
}

/// The framework's table of functions and ours, the same for all instances.
static TABLES: OnceLock<[IAudioProcessorVtbl; 2]> = OnceLock::new();
/// What is known of each plugin, by its address.
static KNOWN: Mutex<BTreeMap<usize, Known>> = Mutex::new(BTreeMap::new());

/// What is known of a plugin.
#[derive(Default)]
struct Known {
    /// The arrangement of the main output that a host has asked for, and got.
    asked: Option<SpeakerArrangement>,
    side: Weak<HostSide>,
}

/// Lets a new plugin name its Ambisonic outputs, its tail and its latency.
#[expect(unsafe_code, reason = "the framework's table of functions is changed")]
fn amend(processor: *mut IAudioProcessor, side: Option<&Arc<HostSide>>) {
    // Another may have been there before, and those that are gone need not be known.
    let mut known = lock(&KNOWN);
    known.retain(|_, known| known.side.strong_count() > 0);
    known.insert(processor.addr(), Known { asked: None, side: side.map_or_else(Weak::new, Arc::downgrade) });
    drop(known);
    // SAFETY: the plugin is alive and nobody else knows it yet; tables live as long as the library.
    unsafe {
        let theirs = *(*processor).vtbl;
        let ours = IAudioProcessorVtbl {
            setBusArrangements: set_bus_arrangements,
            getBusArrangement: get_bus_arrangement,
            getTailSamples: get_tail_samples,
            getLatencySamples: get_latency_samples,
            setupProcessing: setup_processing,
            ..theirs
        };
        (*processor).vtbl = &raw const TABLES.get_or_init(|| [theirs, ours])[1];
    }
}

/// What an instance shows of its host.
fn side_of(processor: *mut IAudioProcessor) -> Option<Arc<HostSide>> {
    lock(&KNOWN).get(&processor.addr())?.side.upgrade()
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
    let Some([theirs, _]) = TABLES.get() else { return kInvalidArgument };
    // SAFETY: the plugin is the framework's, and the host's argument is handed on.
    let result = unsafe { (theirs.setupProcessing)(this, setup) };
    // SAFETY: the host hands over a setup or none.
    if let (Some(setup), Some(side)) = (unsafe { setup.as_ref() }.filter(|_| result == kResultOk), side_of(this)) {
        side.prepare(setup.sampleRate);
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
    let Some([theirs, _]) = TABLES.get() else { return kInvalidArgument };
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (theirs.setBusArrangements)(this, inputs, input_count, outputs, output_count) };
    // SAFETY: there is one for each output.
    if let Some(output) = unsafe { outputs.as_ref() }.filter(|_| result == kResultOk && output_count > 0) {
        lock(&KNOWN).entry(this.addr()).or_default().asked = Some(*output);
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
    let Some([theirs, _]) = TABLES.get() else { return kInvalidArgument };
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
    let result = unsafe { (theirs.getBusArrangement)(this, dir, index, arr) };
    let is_output = i64::from(dir) == i64::from(BusDirections_::kOutput);
    // SAFETY: the framework has filled it in.
    if let Some(arr) = unsafe { arr.as_mut() }.filter(|_| result == kResultOk && is_output) {
        let count = arr.count_ones();
        let asked = lock(&KNOWN).get(&this.addr()).and_then(|known| known.asked);
        let asked = asked.filter(|asked| asked.count_ones() == count);
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

/// Where hosts find the plugin.
#[unsafe(no_mangle)]
#[expect(unsafe_code, reason = "hosts find the entry by its name")]
extern "system" fn GetPluginFactory() -> *mut c_void {
    let factory = ComWrapper::new(Factory(PluginInfo::for_plugin::<Promenade>()));
    factory.to_com_ptr::<IPluginFactory>().map_or(std::ptr::null_mut(), |factory| factory.into_raw().cast())
}

/// Declares what hosts call when they load the library and let go of it.
macro_rules! module {
    ($system:meta, $abi:literal, $enter:ident ($($handle:ty)?), $leave:ident) => {
        #[cfg($system)]
        #[unsafe(no_mangle)]
        #[expect(unsafe_code, reason = "hosts find it by its name")]
        extern $abi fn $enter($(_library: $handle)?) -> bool {
            setup_logger::<Promenade>();
            true
        }

        #[cfg($system)]
        #[unsafe(no_mangle)]
        #[expect(unsafe_code, reason = "hosts find it by its name")]
        extern $abi fn $leave() -> bool {
            true
        }
    };
}

module!(all(target_family = "unix", not(target_os = "macos")), "C", ModuleEntry(*mut c_void), ModuleExit);
module!(target_os = "macos", "C", bundleEntry(*mut c_void), bundleExit);
module!(target_os = "windows", "system", InitDll(), ExitDll);
