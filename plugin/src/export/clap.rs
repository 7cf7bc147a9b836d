//! The CLAP entry: the framework's plugin, with what the framework lacks put beside it.
//!
//! The framework's own entry has no presets, no Ambisonics, none of a host's menus and marks, and no angles that go round.
//! It has no tail before the first block, and asks for another activation when it learns the latency in the first one.
//! Its editor takes the host's part of the extension for granted: opened in a host without it, it takes the host down.
//!
//! Hosts get a plugin of ours, [`Hosted`], whose functions are the framework's but for those that are changed here. The
//! framework finds its part by `plugin_data`, which is the same in both.

#![expect(unsafe_code, reason = "hosts and the framework hand over pointers, and are asked through tables of functions")]

mod ambisonic;
mod context_menu;
mod delays;
mod further_ports;
mod param_indication;
mod params;
mod preset_discovery;
mod preset_load;
mod state;
mod values;

use crate::export::{Promenade, PromenadeMany, PromenadeMany64, guard::guard, kind::COUNT};
use crate::parameter::Parameter;
use crate::project::host_values::host_id;
use crate::telemetry::host_side::HostSide;
use clap_sys::ext::latency::CLAP_EXT_LATENCY;
use clap_sys::ext::tail::CLAP_EXT_TAIL;
use clap_sys::process::clap_process;
use nice_plug::prelude::ClapPlugin;
use nice_plug::wrapper::clap::{
    CLAP_PLUGIN_FACTORY_ID, CLAP_VERSION, PluginDescriptor, Wrapper, clap_host, clap_plugin, clap_plugin_descriptor,
    clap_plugin_entry, clap_plugin_factory,
};
use nice_plug::wrapper::setup_logger;
use std::ffi::{CStr, c_char, c_void};
use std::sync::{Arc, LazyLock, OnceLock};

/// Name of the editor's extension, the plugin's and the host's.
const EDITOR: &CStr = c"clap.gui";

#[unsafe(no_mangle)]
#[used]
static clap_entry: clap_plugin_entry =
    clap_plugin_entry { clap_version: CLAP_VERSION, init: Some(init), deinit: Some(deinit), get_factory: Some(get_factory) };

static FACTORY: clap_plugin_factory = clap_plugin_factory {
    get_plugin_count: Some(plugin_count),
    get_plugin_descriptor: Some(plugin_descriptor),
    create_plugin: Some(create_plugin),
};

/// Of all plugins, in the order of [`KINDS`].
static DESCRIPTORS: LazyLock<[PluginDescriptor; COUNT]> = LazyLock::new(|| {
    [
        PluginDescriptor::for_plugin::<Promenade>(),
        PluginDescriptor::for_plugin::<PromenadeMany>(),
        PluginDescriptor::for_plugin::<PromenadeMany64>(),
    ]
});

/// Makes a plugin of the framework, and lets it go.
type Makers = (fn(*const clap_host) -> clap_plugin, Unmake);
type Unmake = unsafe fn(*const clap_plugin);

/// Those of all plugins, in the same order.
const MAKERS: [Makers; COUNT] = [makers::<Promenade>(), makers::<PromenadeMany>(), makers::<PromenadeMany64>()];

/// A plugin as hosts hold it.
#[repr(C)]
struct Hosted {
    /// First, so that a pointer to it is one to the whole.
    plugin: clap_plugin,
    host: *const clap_host,
    /// What the instance shows of its host.
    side: Arc<HostSide>,
    /// What the framework's plugin does itself, the same for all of its kind.
    theirs: Theirs,
    /// Which of [`KINDS`] it is.
    kind: usize,
}

/// A table of functions with some of ours, which is made once for each kind of plugin.
struct Tables<T>([OnceLock<T>; COUNT]);

impl<T> Tables<T> {
    const fn new() -> Self {
        Self([const { OnceLock::new() }; COUNT])
    }

    /// That of a plugin.
    fn of(&self, plugin: *const clap_plugin, make: impl FnOnce() -> T) -> Option<&T> {
        Some(self.0[hosted(plugin)?.kind].get_or_init(make))
    }
}

type GetExtension = unsafe extern "C" fn(*const clap_plugin, *const c_char) -> *const c_void;
type Call = unsafe extern "C" fn(*const clap_plugin);

type Process = unsafe extern "C" fn(*const clap_plugin, *const clap_process) -> i32;

#[derive(Clone, Copy)]
struct Theirs {
    init: unsafe extern "C" fn(*const clap_plugin) -> bool,
    get_extension: GetExtension,
    on_main_thread: Call,
    unmake: Unmake,
    process: Process,
    start: unsafe extern "C" fn(*const clap_plugin) -> bool,
}

extern "C" fn init(_path: *const c_char) -> bool {
    setup_logger::<Promenade>();
    true
}

extern "C" fn deinit() {}

extern "C" fn get_factory(id: *const c_char) -> *const c_void {
    // SAFETY: hosts name factories by text that ends with a zero.
    let Some(id) = (!id.is_null()).then(|| unsafe { CStr::from_ptr(id) }) else { return std::ptr::null() };
    if id == CLAP_PLUGIN_FACTORY_ID {
        return (&raw const FACTORY).cast();
    }
    preset_discovery::factory(id).unwrap_or_default()
}

unsafe extern "C" fn plugin_count(_factory: *const clap_plugin_factory) -> u32 {
    u32::try_from(COUNT).unwrap_or(0)
}

unsafe extern "C" fn plugin_descriptor(_factory: *const clap_plugin_factory, index: u32) -> *const clap_plugin_descriptor {
    let found = usize::try_from(index).ok().and_then(|index| DESCRIPTORS.get(index));
    found.map_or(std::ptr::null(), |found| std::ptr::from_ref(found.clap_plugin_descriptor()))
}

unsafe extern "C" fn create_plugin(
    _factory: *const clap_plugin_factory,
    host: *const clap_host,
    id: *const c_char,
) -> *const clap_plugin {
    // SAFETY: hosts name plugins by text that ends with a zero.
    let Some(id) = (!host.is_null() && !id.is_null()).then(|| unsafe { CStr::from_ptr(id) }) else { return std::ptr::null() };
    let Some(kind) = DESCRIPTORS.iter().position(|known| known.clap_id() == id) else { return std::ptr::null() };
    let (make, unmake) = MAKERS[kind];
    let Some((theirs, side)) = guard(None, || Some((make(host), HostSide::newborn()?))) else { return std::ptr::null() };
    let (Some(init), Some(get_extension), Some(on_main_thread), Some(process), Some(start)) =
        (theirs.init, theirs.get_extension, theirs.on_main_thread, theirs.process, theirs.start_processing)
    else {
        return std::ptr::null();
    };
    let plugin = clap_plugin {
        init: Some(connect_and_init),
        get_extension: Some(get_fitting_extension),
        on_main_thread: Some(serve_on_main_thread),
        destroy: Some(forget_and_destroy),
        process: Some(values::process),
        start_processing: Some(start_and_go_on),
        ..theirs
    };
    let theirs = Theirs { init, get_extension, on_main_thread, unmake, process, start };
    Box::into_raw(Box::new(Hosted { plugin, host, side, theirs, kind })).cast()
}

const fn makers<P: ClapPlugin>() -> Makers {
    (made::<P>, unmade::<P>)
}

/// A plugin of the framework, for a host that is there.
fn made<P: ClapPlugin>(host: *const clap_host) -> clap_plugin {
    // SAFETY: the host is alive. `unmade` takes this reference back.
    let wrapper = Arc::into_raw(unsafe { Wrapper::<P>::new(host) });
    // SAFETY: the wrapper is alive, and nobody else knows it yet.
    unsafe { *(*wrapper).clap_plugin.as_ptr() }
}

/// Lets a plugin of the framework go, as its `destroy` does, which a panic would leave.
///
/// # Safety
/// The plugin is of this type, and nobody uses it any more.
unsafe fn unmade<P: ClapPlugin>(plugin: *const clap_plugin) {
    // SAFETY: `made` has made it, with one reference.
    drop(unsafe { Arc::from_raw((*plugin).plugin_data.cast::<Wrapper<P>>()) });
}

/// The whole of a plugin.
fn hosted<'a>(plugin: *const clap_plugin) -> Option<&'a Hosted> {
    // SAFETY: hosts have got all of their plugins from here, and call none that they have destroyed.
    unsafe { plugin.cast::<Hosted>().as_ref() }
}

/// Connects the instance with its host, whose extensions may be asked for from now on.
unsafe extern "C" fn connect_and_init(plugin: *const clap_plugin) -> bool {
    guard((), || {
        if let Some(Hosted { host, side, .. }) = hosted(plugin) {
            let host = host.expose_provenance();
            let calls = delays::calls(plugin);
            side.connect(move || wake(host), calls);
        }
    });
    // SAFETY: the plugin is the framework's.
    hosted(plugin).is_some_and(|hosted| unsafe { (hosted.theirs.init)(plugin) })
}

/// Asks a host for a call on its main thread, on any thread.
fn wake(host: usize) {
    let host = std::ptr::with_exposed_provenance::<clap_host>(host);
    // SAFETY: hosts outlive their plugins, and a plugin that is gone asks for nothing.
    unsafe {
        if let Some(request) = (*host).request_callback {
            request(host);
        }
    }
}

/// Starts, and after a mere pause goes on: some hosts stop and start around each block, where the framework would begin anew.
unsafe extern "C" fn start_and_go_on(plugin: *const clap_plugin) -> bool {
    let Some(Hosted { side, theirs, .. }) = hosted(plugin) else { return false };
    // SAFETY: the plugin is the framework's.
    side.starting(|| unsafe { (theirs.start)(plugin) })
}

unsafe extern "C" fn serve_on_main_thread(plugin: *const clap_plugin) {
    guard((), || {
        if let Some(side) = host_side(plugin) {
            context_menu::serve(plugin, &side);
        }
    });
    if let Some(hosted) = hosted(plugin) {
        // SAFETY: the plugin is the framework's.
        unsafe { (hosted.theirs.on_main_thread)(plugin) };
    }
}

/// The plugin's extension of that name, but no editor where the host has none of its part.
unsafe extern "C" fn get_fitting_extension(plugin: *const clap_plugin, id: *const c_char) -> *const c_void {
    // SAFETY: hosts name extensions by text that ends with a zero.
    let Some(name) = (!id.is_null()).then(|| unsafe { CStr::from_ptr(id) }) else { return std::ptr::null() };
    fn of<T>(table: &'static T) -> *const c_void {
        std::ptr::from_ref(table).cast()
    }
    let is = |ids: &[&CStr]| ids.contains(&name);
    match () {
        () if is(&preset_load::IDS) => return of(&preset_load::EXTENSION),
        () if is(&param_indication::IDS) => return of(&param_indication::EXTENSION),
        () if is(&ambisonic::IDS) => return of(&ambisonic::EXTENSION),
        () if is(&[CLAP_EXT_TAIL]) => return of(&delays::TAIL),
        () if is(&[CLAP_EXT_LATENCY]) => return of(&delays::LATENCY),
        () if is(&[params::ID]) => return params::extension(plugin).map_or(std::ptr::null(), of),
        () if is(&[ambisonic::PORTS]) => return ambisonic::ports(plugin).map_or(std::ptr::null(), of),
        () if is(&[ambisonic::CONFIGS]) => return ambisonic::configs(plugin).map_or(std::ptr::null(), of),
        () if is(&[EDITOR]) && host_extension::<c_void>(plugin, &[EDITOR]).is_none() => return std::ptr::null(),
        () => (),
    }
    match hosted(plugin) {
        // SAFETY: the plugin is the framework's, and the host's arguments are handed on.
        Some(hosted) => unsafe { (hosted.theirs.get_extension)(plugin, id) },
        None => std::ptr::null(),
    }
}

/// The framework's own extension of a name, whose table of functions is `T`.
fn framework_extension<T>(plugin: *const clap_plugin, id: &CStr) -> Option<&'static T> {
    let theirs = &hosted(plugin)?.theirs;
    // SAFETY: the plugin is the framework's; its tables live as long as it does, longer than any call that comes from a host.
    unsafe { (theirs.get_extension)(plugin, id.as_ptr()).cast::<T>().as_ref() }
}

/// What an instance shows of its host.
fn host_side(plugin: *const clap_plugin) -> Option<Arc<HostSide>> {
    hosted(plugin).map(|hosted| Arc::clone(&hosted.side))
}

/// The number by which hosts know a parameter, as the framework makes it of the id.
pub(crate) fn parameter_id(parameter: Parameter) -> u32 {
    host_id(parameter.id())
}

/// The parameter of a number.
fn parameter_of(id: u32) -> Option<Parameter> {
    Parameter::EVERY.into_iter().find(|parameter| parameter_id(*parameter) == id)
}

/// A plugin's host, and the first of its extensions by these names, whose table of functions is `T`.
fn host_extension<T>(plugin: *const clap_plugin, ids: &[&CStr]) -> Option<(*const clap_host, &'static T)> {
    let host = hosted(plugin)?.host;
    // SAFETY: hosts outlive their plugins, and so do their tables of functions.
    let get_extension = unsafe { (*host).get_extension }?;
    // SAFETY: as above; extensions are asked for after `init` only, so that the host may be asked as well.
    let found = ids.iter().find_map(|id| unsafe { get_extension(host, id.as_ptr()).cast::<T>().as_ref() })?;
    Some((host, found))
}

unsafe extern "C" fn forget_and_destroy(plugin: *const clap_plugin) {
    guard((), || {
        if let Some(hosted) = hosted(plugin) {
            hosted.side.disconnect();
            // SAFETY: the plugin is the framework's and is destroyed once.
            unsafe { (hosted.theirs.unmake)(plugin) };
        }
    });
    // SAFETY: `create_plugin` has made it, and the host holds it no longer.
    drop(unsafe { Box::from_raw(plugin.cast_mut().cast::<Hosted>()) });
}
