#![expect(unsafe_code, reason = "VST3's interfaces are C++ objects")]

use super::{BLOCK, Bare, Change, Plugin, RATE};
use crate::bundle;
use libloading::Library;
use std::cell::Cell;
use std::ffi::c_void;
use std::mem::ManuallyDrop;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use vst3::Steinberg::Linux::{IEventHandler, IRunLoop, IRunLoopTrait, ITimerHandler};
use vst3::Steinberg::Vst::{
    AudioBusBuffers, AudioBusBuffers__type0, IAudioProcessor, IAudioProcessorTrait, IComponent, IComponentHandler,
    IComponentHandlerTrait, IComponentTrait, IEditController, IEditControllerTrait, IParamValueQueue, IParamValueQueueTrait,
    IParameterChanges, IParameterChangesTrait, ParameterInfo, ProcessData, ProcessModes_, ProcessSetup,
};
use vst3::Steinberg::{
    IBStream, IBStreamTrait, IPlugFrame, IPlugFrameTrait, IPlugView, IPlugViewTrait, IPluginFactory, IPluginFactoryTrait, TUID,
    ViewRect, kPlatformTypeX11EmbedWindowID, kResultFalse, kResultOk, tresult,
};
use vst3::{Class, ComPtr, ComWrapper, Interface};

/// What a host holds of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The component.
    Component,
    /// The processor.
    Processor,
    /// The controller.
    Controller,
    /// The editor.
    View,
}

/// One VST3 instance.
pub struct BareVst3 {
    component: Option<ComPtr<IComponent>>,
    processor: Option<ComPtr<IAudioProcessor>>,
    controller: Option<ComPtr<IEditController>>,
    view: Option<ComPtr<IPlugView>>,
    told: Arc<AtomicUsize>,
    of: Plugin,
    /// Whether the setup says that it renders offline.
    pub setup_is_offline: bool,
    /// Whether each block says so.
    pub blocks_are_offline: bool,
}

// SAFETY: a host without manners calls an instance on any thread, one at a time.
unsafe impl Send for BareVst3 {}

/// The library, entered once and never left.
fn factory() -> ComPtr<IPluginFactory> {
    static LIBRARY: OnceLock<ManuallyDrop<Library>> = OnceLock::new();
    let library = LIBRARY.get_or_init(|| {
        let binary = bundle::vst3().join("Contents").join(format!("{}-linux", std::env::consts::ARCH)).join("Promenade.so");
        // SAFETY: it is the plugin's own code, and each module has this function.
        unsafe {
            let library = Library::new(binary).expect("the library is loaded");
            let enter = library.get::<unsafe extern "C" fn(*mut c_void) -> bool>(b"ModuleEntry").expect("a module");
            assert!(enter(null_mut()));
            ManuallyDrop::new(library)
        }
    });
    // SAFETY: as above.
    unsafe {
        let get = library.get::<unsafe extern "system" fn() -> *mut IPluginFactory>(b"GetPluginFactory").expect("a module");
        ComPtr::from_raw(get()).expect("there is a factory")
    }
}

impl BareVst3 {
    /// Gives a reference back.
    pub fn release(&mut self, part: Part) {
        match part {
            Part::Component => drop(self.component.take()),
            Part::Processor => drop(self.processor.take()),
            Part::Controller => drop(self.controller.take()),
            Part::View => drop(self.view.take()),
        }
    }

    fn component(&self) -> &ComPtr<IComponent> {
        self.component.as_ref().expect("the component is held")
    }

    fn processor(&self) -> &ComPtr<IAudioProcessor> {
        self.processor.as_ref().expect("the processor is held")
    }

    fn controller(&self) -> &ComPtr<IEditController> {
        self.controller.as_ref().expect("the controller is held")
    }

    /// Opens the editor in a window; it stays open.
    ///
    /// # Panics
    /// It does not open.
    pub fn open_editor(&mut self, window: u32) {
        let frame = ComWrapper::new(Frame).to_com_ptr::<IPlugFrame>().expect("a frame");
        // SAFETY: the window is there, and the view holds its frame.
        unsafe {
            let view = ComPtr::from_raw(self.controller().createView(c"editor".as_ptr())).expect("there is an editor");
            assert_eq!(view.setFrame(frame.as_ptr()), kResultOk);
            let parent = std::ptr::without_provenance_mut(window as usize);
            assert_eq!(view.attached(parent, kPlatformTypeX11EmbedWindowID), kResultOk);
            self.view = Some(view);
        }
    }

    /// Closes the editor.
    pub fn close_editor(&mut self) {
        if let Some(view) = self.view.take() {
            // SAFETY: it is attached.
            unsafe {
                view.removed();
                view.setFrame(null_mut());
            }
        }
    }
}

impl Bare for BareVst3 {
    fn make(of: Plugin) -> Self {
        let factory = factory();
        let class = match of {
            Plugin::One => b"PromenadeSpatial",
            Plugin::Many => b"PromenadeSp.Many",
        };
        let class: TUID = class.map(u8::cast_signed);
        let mut object: *mut c_void = null_mut();
        let told = Arc::new(AtomicUsize::new(0));
        let handler = ComWrapper::new(Handler(Arc::clone(&told))).to_com_ptr::<IComponentHandler>().expect("a handler");
        // SAFETY: both ids are 16 bytes, and the plugin holds its handler.
        unsafe {
            assert_eq!(factory.createInstance(class.as_ptr(), IComponent::IID.as_ptr().cast(), &raw mut object), kResultOk);
            let component = ComPtr::from_raw(object.cast::<IComponent>()).expect("there is a component");
            let controller = component.cast::<IEditController>().expect("the component is the controller");
            controller.setComponentHandler(handler.as_ptr());
            let processor = component.cast::<IAudioProcessor>();
            Self {
                component: Some(component),
                processor,
                controller: Some(controller),
                view: None,
                told,
                of,
                setup_is_offline: false,
                blocks_are_offline: false,
            }
        }
    }

    fn activate(&mut self) {
        let most = i32::try_from(BLOCK).unwrap_or(0);
        let mut setup = ProcessSetup {
            processMode: mode(self.setup_is_offline),
            symbolicSampleSize: 0,
            maxSamplesPerBlock: most,
            sampleRate: RATE,
        };
        // SAFETY: the plugin is there.
        unsafe {
            assert_eq!(self.processor().setupProcessing(&raw mut setup), kResultOk);
            assert_eq!(self.component().setActive(1), kResultOk);
        }
    }

    fn deactivate(&mut self) {
        // SAFETY: as above.
        unsafe { self.component().setActive(0) };
    }

    fn play(&mut self, plays: bool) {
        // SAFETY: as above.
        unsafe { self.processor().setProcessing(u8::from(plays)) };
    }

    fn block(&mut self, input: &[f32], changes: &[Change]) -> [Vec<f32>; 2] {
        let (fed, of_each) = self.of.channels();
        let mut copies = vec![input.to_vec(); fed];
        let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
        let mut ins = copies.iter_mut().map(Vec::as_mut_ptr).collect::<Vec<_>>();
        let mut outs = out.each_mut().map(Vec::as_mut_ptr);
        let bus = |channels: &mut [*mut f32]| AudioBusBuffers {
            numChannels: i32::try_from(channels.len()).unwrap_or(0),
            silenceFlags: 0,
            __field0: AudioBusBuffers__type0 { channelBuffers32: channels.as_mut_ptr() },
        };
        let (mut inputs, mut outputs) = (ins.chunks_mut(of_each).map(bus).collect::<Vec<_>>(), bus(&mut outs));
        let mut ids = changes.iter().map(|(id, ..)| *id).collect::<Vec<_>>();
        ids.sort_unstable();
        ids.dedup();
        let queue = |id: u32| {
            let points = changes.iter().filter(|change| change.0 == id).map(|(_, sample, value)| (*sample, *value));
            ComWrapper::new(Queue(id, points.collect())).to_com_ptr::<IParamValueQueue>().expect("a queue")
        };
        let queues = ComWrapper::new(Queues(ids.into_iter().map(queue).collect()));
        let list = queues.as_com_ref::<IParameterChanges>().expect("a list");
        let mut data = ProcessData {
            processMode: mode(self.blocks_are_offline),
            symbolicSampleSize: 0,
            numSamples: i32::try_from(input.len()).unwrap_or(0),
            numInputs: i32::try_from(inputs.len()).unwrap_or(0),
            numOutputs: 1,
            inputs: inputs.as_mut_ptr(),
            outputs: &raw mut outputs,
            inputParameterChanges: list.as_ptr(),
            outputParameterChanges: null_mut(),
            inputEvents: null_mut(),
            outputEvents: null_mut(),
            processContext: null_mut(),
        };
        // SAFETY: everything that the block points to lives through the call.
        assert_eq!(unsafe { self.processor().process(&raw mut data) }, kResultOk);
        out
    }

    fn set(&mut self, id: u32, value: f64) {
        // SAFETY: the plugin is there.
        assert_eq!(unsafe { self.controller().setParamNormalized(id, value) }, kResultOk);
    }

    fn value(&mut self, id: u32) -> f64 {
        // SAFETY: as above.
        unsafe { self.controller().getParamNormalized(id) }
    }

    fn ids(&mut self) -> Vec<u32> {
        // SAFETY: as above; a description of zeros is filled in.
        let of = |index: i32| unsafe {
            let mut info: ParameterInfo = std::mem::zeroed();
            (self.controller().getParameterInfo(index, &raw mut info) == kResultOk).then_some(info.id)
        };
        // SAFETY: as above.
        (0..unsafe { self.controller().getParameterCount() }).filter_map(of).collect()
    }

    fn save(&mut self) -> Vec<u8> {
        let stream = ComWrapper::new(Stream::default());
        let handed = stream.as_com_ref::<IBStream>().expect("a stream");
        // SAFETY: the stream lives through the call.
        assert_eq!(unsafe { self.component().getState(handed.as_ptr()) }, kResultOk);
        stream.bytes.lock().expect("nothing has panicked").clone()
    }

    fn load(&mut self, state: &[u8]) {
        let stream = ComWrapper::new(Stream { bytes: Mutex::new(state.to_vec()), at: Cell::new(0) });
        let handed = stream.as_com_ref::<IBStream>().expect("a stream");
        // SAFETY: as above.
        assert_eq!(unsafe { self.component().setState(handed.as_ptr()) }, kResultOk);
    }

    fn told(&self) -> usize {
        self.told.load(Ordering::Acquire)
    }
}

/// The format's number for how a host renders.
fn mode(is_offline: bool) -> i32 {
    (if is_offline { ProcessModes_::kOffline } else { ProcessModes_::kRealtime }).cast_signed()
}

/// Counts what the plugin asks for.
struct Handler(Arc<AtomicUsize>);

impl Class for Handler {
    type Interfaces = (IComponentHandler,);
}

impl IComponentHandlerTrait for Handler {
    unsafe fn beginEdit(&self, _id: u32) -> tresult {
        kResultOk
    }

    unsafe fn performEdit(&self, _id: u32, _value: f64) -> tresult {
        kResultOk
    }

    unsafe fn endEdit(&self, _id: u32) -> tresult {
        kResultOk
    }

    unsafe fn restartComponent(&self, _flags: i32) -> tresult {
        self.0.fetch_add(1, Ordering::AcqRel);
        kResultOk
    }
}

/// A window that is never resized, with a loop that never turns.
struct Frame;

impl Class for Frame {
    type Interfaces = (IPlugFrame, IRunLoop);
}

impl IPlugFrameTrait for Frame {
    unsafe fn resizeView(&self, _view: *mut IPlugView, _size: *mut ViewRect) -> tresult {
        kResultFalse
    }
}

impl IRunLoopTrait for Frame {
    unsafe fn registerEventHandler(&self, _handler: *mut IEventHandler, _fd: i32) -> tresult {
        kResultOk
    }

    unsafe fn unregisterEventHandler(&self, _handler: *mut IEventHandler) -> tresult {
        kResultOk
    }

    unsafe fn registerTimer(&self, _handler: *mut ITimerHandler, _milliseconds: u64) -> tresult {
        kResultOk
    }

    unsafe fn unregisterTimer(&self, _handler: *mut ITimerHandler) -> tresult {
        kResultOk
    }
}

/// The changes of a block.
struct Queues(Vec<ComPtr<IParamValueQueue>>);

impl Class for Queues {
    type Interfaces = (IParameterChanges,);
}

impl IParameterChangesTrait for Queues {
    unsafe fn getParameterCount(&self) -> i32 {
        i32::try_from(self.0.len()).unwrap_or(0)
    }

    unsafe fn getParameterData(&self, index: i32) -> *mut IParamValueQueue {
        usize::try_from(index).ok().and_then(|index| self.0.get(index)).map_or(null_mut(), ComPtr::as_ptr)
    }

    unsafe fn addParameterData(&self, _id: *const u32, _index: *mut i32) -> *mut IParamValueQueue {
        null_mut()
    }
}

/// Those of one parameter.
struct Queue(u32, Vec<(u32, f64)>);

impl Class for Queue {
    type Interfaces = (IParamValueQueue,);
}

impl IParamValueQueueTrait for Queue {
    unsafe fn getParameterId(&self) -> u32 {
        self.0
    }

    unsafe fn getPointCount(&self) -> i32 {
        i32::try_from(self.1.len()).unwrap_or(0)
    }

    unsafe fn getPoint(&self, index: i32, sample: *mut i32, value: *mut f64) -> tresult {
        let Some((at, share)) = usize::try_from(index).ok().and_then(|index| self.1.get(index)) else { return kResultFalse };
        // SAFETY: the plugin hands over room for both.
        unsafe { (*sample, *value) = (at.cast_signed(), *share) };
        kResultOk
    }

    unsafe fn addPoint(&self, _sample: i32, _value: f64, _index: *mut i32) -> tresult {
        kResultFalse
    }
}

/// A state on its way.
#[derive(Default)]
struct Stream {
    bytes: Mutex<Vec<u8>>,
    at: Cell<usize>,
}

// SAFETY: one thread uses it.
unsafe impl Sync for Stream {}

impl Class for Stream {
    type Interfaces = (IBStream,);
}

impl IBStreamTrait for Stream {
    unsafe fn read(&self, buffer: *mut c_void, count: i32, read: *mut i32) -> tresult {
        let bytes = self.bytes.lock().expect("nothing has panicked");
        let rest = &bytes[self.at.get()..];
        let count = rest.len().min(usize::try_from(count).unwrap_or(0));
        // SAFETY: the plugin hands over room for so many bytes, and for their number or none.
        unsafe {
            std::ptr::copy_nonoverlapping(rest.as_ptr(), buffer.cast::<u8>(), count);
            if let Some(read) = read.as_mut() {
                *read = i32::try_from(count).unwrap_or(0);
            }
        }
        self.at.set(self.at.get() + count);
        kResultOk
    }

    unsafe fn write(&self, buffer: *mut c_void, count: i32, written: *mut i32) -> tresult {
        // SAFETY: the plugin hands over so many bytes, and room for their number or none.
        unsafe {
            let new = std::slice::from_raw_parts(buffer.cast::<u8>(), usize::try_from(count).unwrap_or(0));
            self.bytes.lock().expect("nothing has panicked").extend_from_slice(new);
            if let Some(written) = written.as_mut() {
                *written = count;
            }
        }
        kResultOk
    }

    unsafe fn seek(&self, position: i64, mode: i32, result: *mut i64) -> tresult {
        let length = self.bytes.lock().expect("nothing has panicked").len();
        let from = [0, self.at.get(), length][usize::try_from(mode).unwrap_or(0)];
        let to = (from.cast_signed() as i64 + position).clamp(0, length.cast_signed() as i64);
        self.at.set(usize::try_from(to).unwrap_or(0));
        // SAFETY: the plugin hands over room for the place or none.
        if let Some(result) = unsafe { result.as_mut() } {
            *result = to;
        }
        kResultOk
    }

    unsafe fn tell(&self, position: *mut i64) -> tresult {
        // SAFETY: the plugin hands over room for the place.
        unsafe { *position = self.at.get().cast_signed() as i64 };
        kResultOk
    }
}
