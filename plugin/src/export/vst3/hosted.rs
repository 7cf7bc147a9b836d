//! A plugin as VST3 hosts hold it: the framework's, with functions of ours in its tables.
//!
//! Hosts' references are counted here, and the framework's object has one reference, which is ours: it goes where a panic can
//! be caught, and not before the framework's queue holds nothing of it any more. The queue's thread ends when it meets a task
//! whose instance is gone; what other instances post is lost then, and the last release panics.

use super::{block_room::BlockRoom, controller_values::ControllerValues};
use crate::export::{Promenade, guard::guard, kind::COUNT};
use crate::telemetry::host_side::HostSide;
use crate::worker::lock::lock;
use nice_plug::nice_error;
use nice_plug::wrapper::vst3::Wrapper;
use nice_plug::wrapper::vst3::vst3::Steinberg::Vst::SpeakerArrangement;
use nice_plug::wrapper::vst3::vst3::Steinberg::{FUnknown, FUnknownVtbl, TUID, kResultOk, tresult};
use nice_plug::wrapper::vst3::vst3::{ComWrapper, Interface};
use std::any::Any;
use std::ffi::c_void;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

/// One instance.
pub(super) struct Hosted {
    /// The framework's object. First, so that it goes before its tables.
    _plugin: Box<dyn Any>,
    /// The tables of functions of all of its interfaces.
    tables: Vec<Arc<dyn Any>>,
    /// References of the host.
    references: AtomicU32,
    /// Which of [`KINDS`](crate::export::kind::KINDS) it is.
    pub(super) kind: usize,
    /// What it shows of its host.
    pub(super) side: Arc<HostSide>,
    /// The arrangement of the main output that the host has asked for, and got.
    pub(super) asked: Mutex<Option<SpeakerArrangement>>,
    /// Held while a block is played.
    pub(super) block: Mutex<BlockRoom>,
    /// What the host has set on the controller alone.
    pub(super) controller: ControllerValues,
}

/// The table of functions of one interface of an instance.
#[repr(C)]
pub(super) struct Table<V> {
    /// First, so that a pointer to it is one to the whole.
    ours: V,
    /// The framework's own.
    pub(super) theirs: V,
    hosted: *const Hosted,
}

impl<V> Table<V> {
    /// The instance.
    pub(super) fn hosted(&self) -> &Hosted {
        // SAFETY: it lives as long as any reference of the host, through which this table was found.
        unsafe { &*self.hosted }
    }

    /// The part of the framework's table that all interfaces have.
    fn unknown(&self) -> &FUnknownVtbl {
        // SAFETY: every interface's table begins with these functions.
        unsafe { &*(&raw const self.theirs).cast::<FUnknownVtbl>() }
    }
}

/// The table of an interface that a host calls.
pub(super) fn table<'a, I: Interface>(this: *mut I) -> &'a Table<I::Vtbl> {
    // SAFETY: hosts call these functions by the table that `amend` has put there, which lives as long as the plugin.
    unsafe { &**this.cast::<*const Table<I::Vtbl>>() }
}

/// A plugin of the framework, and what it shows of its host.
pub(super) fn framework_plugin<const FURTHER: usize>() -> Option<(ComWrapper<Wrapper<Promenade<FURTHER>>>, Arc<HostSide>)> {
    let plugin = ComWrapper::new(Wrapper::<Promenade<FURTHER>>::new());
    Some((plugin, HostSide::newborn()?))
}

/// Puts a table of ours in the place of one of the framework's.
pub(super) fn amend<I, const FURTHER: usize>(
    plugin: &ComWrapper<Wrapper<Promenade<FURTHER>>>,
    hosted: *mut Hosted,
    change: impl FnOnce(&mut I::Vtbl),
) where
    I: Interface,
    I::Vtbl: Copy + 'static,
{
    let Some(interface) = plugin.as_com_ref::<I>() else { return };
    let place = interface.as_ptr().cast::<*const I::Vtbl>();
    // SAFETY: the plugin is alive and nobody else knows it yet; every interface's table begins with that of `FUnknown`.
    unsafe {
        let theirs = **place;
        let mut ours = theirs;
        change(&mut ours);
        let unknown = &mut *(&raw mut ours).cast::<FUnknownVtbl>();
        unknown.queryInterface = query_interface::<I::Vtbl>;
        unknown.addRef = add_ref::<I::Vtbl>;
        unknown.release = release::<I::Vtbl>;
        let table = Arc::new(Table { ours, theirs, hosted });
        *place = Arc::as_ptr(&table).cast::<I::Vtbl>();
        (*hosted).tables.push(table);
    }
}

/// The table behind any interface, whose functions are `V`.
fn table_of<'a, V>(this: *mut FUnknown) -> &'a Table<V> {
    // SAFETY: as in `table`.
    unsafe { &*(*this).vtbl.cast::<Table<V>>() }
}

unsafe extern "system" fn query_interface<V>(this: *mut FUnknown, iid: *const TUID, obj: *mut *mut c_void) -> tresult {
    let table = table_of::<V>(this);
    // SAFETY: the plugin is the framework's, and the host's arguments are handed on. The framework counts the new reference,
    // which is counted here instead; its last one is ours.
    unsafe {
        let result = (table.unknown().queryInterface)(this, iid, obj);
        if result == kResultOk {
            table.hosted().references.fetch_add(1, Ordering::Relaxed);
            (table.unknown().release)(this);
        }
        result
    }
}

unsafe extern "system" fn add_ref<V>(this: *mut FUnknown) -> u32 {
    table_of::<V>(this).hosted().references.fetch_add(1, Ordering::Relaxed) + 1
}

unsafe extern "system" fn release<V>(this: *mut FUnknown) -> u32 {
    let hosted = table_of::<V>(this).hosted;
    // SAFETY: the host has a reference. Whoever gives the last one back is alone with the instance.
    unsafe {
        let left = (*hosted).references.fetch_sub(1, Ordering::AcqRel) - 1;
        if left == 0 {
            let hosted = Box::from_raw(hosted.cast_mut());
            guard((), || hosted.retire());
        }
        left
    }
}

/// An instance that no host holds any more.
struct Retired(Box<Hosted>);

// SAFETY: nobody else knows it; what the framework has made for it may be dropped on any thread.
unsafe impl Send for Retired {}

/// Those that wait until the framework's queue has let go of them.
static RETIRED: Mutex<Vec<Retired>> = Mutex::new(Vec::new());

impl Hosted {
    /// A plugin of the framework, of a kind, that shows this of its host; the host has one reference.
    pub(super) fn new<const FURTHER: usize>(
        plugin: &ComWrapper<Wrapper<Promenade<FURTHER>>>,
        kind: usize,
        side: Arc<HostSide>,
    ) -> Option<Self> {
        Some(Self {
            _plugin: Box::new(plugin.clone()),
            tables: Vec::new(),
            references: AtomicU32::new(1),
            kind,
            asked: Mutex::default(),
            block: Mutex::new(BlockRoom::new(&side, FURTHER)?),
            controller: ControllerValues::default(),
            side,
        })
    }

    /// Lets the instance go, with those of its kind that could not go before, as soon as no task of theirs is left.
    fn retire(self: Box<Self>) {
        // Another thread may still play a block of it.
        drop(lock(&self.block));
        let kind = self.kind;
        lock(&RETIRED).push(Retired(self));
        let mut going: Vec<_> = lock(&RETIRED).extract_if(.., |Retired(hosted)| hosted.kind == kind).collect();
        if queue_is_done(kind) {
            for retired in going {
                guard((), || drop(retired));
            }
        } else {
            nice_error!("the framework's tasks do not come to an end; {} instances stay in memory", going.len());
            lock(&RETIRED).append(&mut going);
        }
    }
}

/// A plugin of each kind that no host knows and that never goes, and with it the framework's queue and its thread. On systems
/// with an event loop of their own the framework posts nothing there.
static KEEPERS: [OnceLock<Keeper>; COUNT] = [const { OnceLock::new() }; COUNT];

struct Keeper {
    _plugin: Box<dyn Any + Send + Sync>,
    side: Arc<HostSide>,
}

/// Keeps the queue of a kind of plugin.
pub(super) fn keep_queue<const FURTHER: usize>(kind: usize) -> Option<()> {
    if cfg!(target_os = "linux") && KEEPERS[kind].get().is_none() {
        let (plugin, side) = framework_plugin::<FURTHER>()?;
        // Another thread may have been faster: its keeper does as well.
        let _first = KEEPERS[kind].set(Keeper { _plugin: Box::new(plugin), side });
    }
    Some(())
}

/// Waits until everything is done that the framework has in the queue of a kind of plugin; says whether it is. The keeper's
/// mark is the last of it, so that the queue's thread holds no other instance when the mark comes.
fn queue_is_done(kind: usize) -> bool {
    KEEPERS[kind].get().is_none_or(|keeper| keeper.side.marks.pass())
}
