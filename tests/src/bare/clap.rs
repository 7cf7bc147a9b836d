#![expect(unsafe_code, reason = "CLAP's interfaces are tables of functions")]

use super::{BLOCK, Bare, Change, Plugin, RATE};
use crate::bundle;
use clap_sys::audio_buffer::clap_audio_buffer;
use clap_sys::entry::clap_plugin_entry;
use clap_sys::events::{
    CLAP_CORE_EVENT_SPACE_ID, CLAP_EVENT_PARAM_VALUE, clap_event_header, clap_event_param_value, clap_input_events,
    clap_output_events,
};
use clap_sys::ext::params::{CLAP_EXT_PARAMS, clap_param_info, clap_plugin_params};
use clap_sys::ext::state::{CLAP_EXT_STATE, clap_plugin_state};
use clap_sys::factory::plugin_factory::{CLAP_PLUGIN_FACTORY_ID, clap_plugin_factory};
use clap_sys::host::clap_host;
use clap_sys::plugin::clap_plugin;
use clap_sys::process::{CLAP_PROCESS_ERROR, clap_process};
use clap_sys::stream::{clap_istream, clap_ostream};
use clap_sys::version::CLAP_VERSION;
use libloading::Library;
use std::ffi::{CStr, c_char, c_void};
use std::mem::ManuallyDrop;
use std::ptr::{null, null_mut};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One CLAP instance; it is destroyed when it is dropped, as it is.
pub struct BareClap {
    plugin: *const clap_plugin,
    /// Outlives the plugin.
    host: Box<clap_host>,
    told: Box<AtomicUsize>,
    of: Plugin,
}

// SAFETY: a host without manners calls an instance on any thread, one at a time.
unsafe impl Send for BareClap {}

/// A list of changes, which the plugin reads.
type Events = Vec<clap_event_param_value>;

impl BareClap {
    fn extension<T>(&self, id: &CStr) -> &T {
        // SAFETY: the plugin is there, and its tables live as long.
        unsafe { (*self.plugin).get_extension.expect("a function")(self.plugin, id.as_ptr()).cast::<T>().as_ref() }
            .expect("the plugin has the extension")
    }

    fn params(&self) -> &clap_plugin_params {
        self.extension(CLAP_EXT_PARAMS)
    }

    /// What the plugin is told of changes, whose values count in steps.
    fn events(&self, changes: &[Change]) -> Events {
        let mut sorted = changes.to_vec();
        sorted.sort_by_key(|change| change.1);
        let infos = self.infos();
        let event = |(id, time, value): Change| clap_event_param_value {
            header: clap_event_header {
                size: u32::try_from(size_of::<clap_event_param_value>()).unwrap_or(0),
                time,
                space_id: CLAP_CORE_EVENT_SPACE_ID,
                type_: CLAP_EVENT_PARAM_VALUE,
                flags: 0,
            },
            param_id: id,
            cookie: null_mut(),
            note_id: -1,
            port_index: -1,
            channel: -1,
            key: -1,
            value: value * greatest(&infos, id),
        };
        sorted.into_iter().map(event).collect()
    }

    fn infos(&self) -> Vec<clap_param_info> {
        let params = self.params();
        // SAFETY: the plugin is there; a description of zeros is filled in.
        unsafe {
            let count = params.count.expect("a function")(self.plugin);
            let of = |index: u32| {
                let mut info: clap_param_info = std::mem::zeroed();
                params.get_info.expect("a function")(self.plugin, index, &raw mut info).then_some(info)
            };
            (0..count).filter_map(of).collect()
        }
    }
}

/// The greatest value of a parameter; the least is 0.
fn greatest(infos: &[clap_param_info], id: u32) -> f64 {
    infos.iter().find(|info| info.id == id).map_or(1.0, |info| info.max_value)
}

fn list(events: &Events) -> clap_input_events {
    clap_input_events { ctx: std::ptr::from_ref(events).cast_mut().cast(), size: Some(count), get: Some(get) }
}

unsafe extern "C" fn count(list: *const clap_input_events) -> u32 {
    // SAFETY: `list` has made it.
    u32::try_from(unsafe { &*(*list).ctx.cast::<Events>() }.len()).unwrap_or(0)
}

unsafe extern "C" fn get(list: *const clap_input_events, index: u32) -> *const clap_event_header {
    // SAFETY: as above.
    let events = unsafe { &*(*list).ctx.cast::<Events>() };
    events.get(index as usize).map_or(null(), |event| &raw const event.header)
}

unsafe extern "C" fn push(_list: *const clap_output_events, _event: *const clap_event_header) -> bool {
    true
}

static OUT: clap_output_events = clap_output_events { ctx: null_mut(), try_push: Some(push) };

unsafe extern "C" fn no_extension(_host: *const clap_host, _id: *const c_char) -> *const c_void {
    null()
}

unsafe extern "C" fn asked(host: *const clap_host) {
    // SAFETY: the host is as `make` has made it.
    unsafe { &*(*host).host_data.cast::<AtomicUsize>() }.fetch_add(1, Ordering::AcqRel);
}

unsafe extern "C" fn write(stream: *const clap_ostream, buffer: *const c_void, size: u64) -> i64 {
    // SAFETY: `save` has made the stream, and the plugin hands over so many bytes.
    unsafe {
        let bytes = std::slice::from_raw_parts(buffer.cast::<u8>(), usize::try_from(size).unwrap_or(0));
        (*(*stream).ctx.cast::<Vec<u8>>()).extend_from_slice(bytes);
    }
    size.cast_signed()
}

unsafe extern "C" fn read(stream: *const clap_istream, buffer: *mut c_void, size: u64) -> i64 {
    // SAFETY: `load` has made the stream, and the plugin has room for so many bytes.
    unsafe {
        let rest = &mut *(*stream).ctx.cast::<&[u8]>();
        let (now, later) = rest.split_at(rest.len().min(usize::try_from(size).unwrap_or(0)));
        std::ptr::copy_nonoverlapping(now.as_ptr(), buffer.cast::<u8>(), now.len());
        *rest = later;
        i64::try_from(now.len()).unwrap_or(-1)
    }
}

fn factory() -> &'static clap_plugin_factory {
    static LIBRARY: OnceLock<ManuallyDrop<Library>> = OnceLock::new();
    // SAFETY: it is the plugin's own code, with the entry that each has.
    unsafe {
        let library = LIBRARY.get_or_init(|| {
            let library = Library::new(bundle::clap()).expect("the library is loaded");
            let entry = **library.get::<*const clap_plugin_entry>(b"clap_entry").expect("an entry");
            assert!(entry.init.expect("a function")(c"".as_ptr()));
            ManuallyDrop::new(library)
        });
        let entry = **library.get::<*const clap_plugin_entry>(b"clap_entry").expect("an entry");
        let factory = entry.get_factory.expect("a function")(CLAP_PLUGIN_FACTORY_ID.as_ptr());
        factory.cast::<clap_plugin_factory>().as_ref().expect("there is a factory")
    }
}

impl Bare for BareClap {
    fn make(of: Plugin) -> Self {
        let told = Box::new(AtomicUsize::new(0));
        let host = Box::new(clap_host {
            clap_version: CLAP_VERSION,
            host_data: (&raw const *told).cast_mut().cast(),
            name: c"tests".as_ptr(),
            vendor: c"Promenade".as_ptr(),
            url: c"".as_ptr(),
            version: c"1".as_ptr(),
            get_extension: Some(no_extension),
            request_restart: Some(asked),
            request_process: Some(asked),
            request_callback: Some(asked),
        });
        let factory = factory();
        // SAFETY: the host outlives the plugin.
        unsafe {
            let create = factory.create_plugin.expect("a function");
            let id = match of {
                Plugin::One => c"audio.promenade.promenade",
                Plugin::Many => c"audio.promenade.promenade-many",
            };
            let plugin = create(factory, &raw const *host, id.as_ptr());
            assert!(!plugin.is_null() && (*plugin).init.expect("a function")(plugin));
            Self { plugin, host, told, of }
        }
    }

    fn activate(&mut self) {
        // SAFETY: the plugin is there.
        unsafe {
            let most = u32::try_from(BLOCK).unwrap_or(0);
            assert!((*self.plugin).activate.expect("a function")(self.plugin, RATE, 1, most));
        }
    }

    fn deactivate(&mut self) {
        // SAFETY: as above.
        unsafe { (*self.plugin).deactivate.expect("a function")(self.plugin) };
    }

    fn play(&mut self, plays: bool) {
        // SAFETY: as above.
        unsafe {
            if plays {
                assert!((*self.plugin).start_processing.expect("a function")(self.plugin));
            } else {
                (*self.plugin).stop_processing.expect("a function")(self.plugin);
            }
        }
    }

    fn block(&mut self, input: &[f32], changes: &[Change]) -> [Vec<f32>; 2] {
        let (fed, of_each) = self.of.channels();
        let mut copies = vec![input.to_vec(); fed];
        let mut out = [vec![0.0; input.len()], vec![0.0; input.len()]];
        let mut ins = copies.iter_mut().map(Vec::as_mut_ptr).collect::<Vec<_>>();
        let mut outs = out.each_mut().map(Vec::as_mut_ptr);
        let port = |channels: &mut [*mut f32]| clap_audio_buffer {
            data32: channels.as_mut_ptr(),
            data64: null_mut(),
            channel_count: u32::try_from(channels.len()).unwrap_or(0),
            latency: 0,
            constant_mask: 0,
        };
        let (inputs, mut outputs) = (ins.chunks_mut(of_each).map(port).collect::<Vec<_>>(), port(&mut outs));
        let events = self.events(changes);
        let events = list(&events);
        let block = clap_process {
            steady_time: -1,
            frames_count: u32::try_from(input.len()).unwrap_or(0),
            transport: null(),
            audio_inputs: inputs.as_ptr(),
            audio_outputs: &raw mut outputs,
            audio_inputs_count: u32::try_from(inputs.len()).unwrap_or(0),
            audio_outputs_count: 1,
            in_events: &raw const events,
            out_events: &raw const OUT,
        };
        // SAFETY: everything that the block points to lives through the call.
        let status = unsafe { (*self.plugin).process.expect("a function")(self.plugin, &raw const block) };
        assert_ne!(status, CLAP_PROCESS_ERROR);
        out
    }

    fn set(&mut self, id: u32, value: f64) {
        let events = self.events(&[(id, 0, value)]);
        let events = list(&events);
        // SAFETY: the lists live through the call.
        unsafe { self.params().flush.expect("a function")(self.plugin, &raw const events, &raw const OUT) };
    }

    fn value(&mut self, id: u32) -> f64 {
        let mut value = f64::NAN;
        // SAFETY: the plugin is there.
        unsafe { self.params().get_value.expect("a function")(self.plugin, id, &raw mut value) };
        value / greatest(&self.infos(), id)
    }

    fn ids(&mut self) -> Vec<u32> {
        self.infos().into_iter().map(|info| info.id).collect()
    }

    fn save(&mut self) -> Vec<u8> {
        let mut bytes: Vec<u8> = Vec::new();
        let stream = clap_ostream { ctx: (&raw mut bytes).cast(), write: Some(write) };
        let state: &clap_plugin_state = self.extension(CLAP_EXT_STATE);
        // SAFETY: the stream lives through the call.
        assert!(unsafe { state.save.expect("a function")(self.plugin, &raw const stream) });
        bytes
    }

    fn load(&mut self, state: &[u8]) {
        let mut rest = state;
        let stream = clap_istream { ctx: (&raw mut rest).cast(), read: Some(read) };
        let state: &clap_plugin_state = self.extension(CLAP_EXT_STATE);
        // SAFETY: as above.
        assert!(unsafe { state.load.expect("a function")(self.plugin, &raw const stream) });
    }

    fn told(&self) -> usize {
        self.told.load(Ordering::Acquire)
    }
}

impl Drop for BareClap {
    fn drop(&mut self) {
        // SAFETY: nobody uses it any more; its host is there.
        unsafe { (*self.plugin).destroy.expect("a function")(self.plugin) };
        debug_assert!(self.host.request_callback.is_some(), "the host outlives the plugin");
    }
}
