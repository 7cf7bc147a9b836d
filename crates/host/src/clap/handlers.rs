//! What a CLAP plugin asks its host for.

use crate::mark::Track;
use crate::menu::MenuAction;
use clack_extensions::context_menu::{ContextMenuBuilder, ContextMenuTarget, HostContextMenu, HostContextMenuImpl, Item};
use clack_extensions::gui::{GuiSize, HostGui, HostGuiImpl};
use clack_extensions::latency::{HostLatency, HostLatencyImpl};
use clack_extensions::params::{HostParams, HostParamsImplMainThread, HostParamsImplShared, ParamClearFlags, ParamRescanFlags};
use clack_extensions::preset_discovery::HostPresetLoadImpl;
use clack_extensions::preset_discovery::prelude::{HostPresetLoad, Location};
use clack_extensions::state::{HostState, HostStateImpl};
use clack_extensions::thread_check::{HostThreadCheck, HostThreadCheckImpl};
use clack_extensions::track_info::{HostTrackInfo, HostTrackInfoImpl, TrackInfo, TrackInfoWriter};
use clack_host::prelude::*;
use clack_host::utils::Color;
use std::ffi::CStr;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, ThreadId};

/// What the plugin has asked for, each kept until it is taken.
pub(crate) struct Requests {
    /// The thread that opened the plugin.
    owner: ThreadId,
    /// Whether that thread plays the audio thread now.
    audio: AtomicBool,
    /// Whether the host has editors.
    editors: bool,
    pub(crate) callback: AtomicBool,
    /// That it be activated again.
    pub(crate) restart: AtomicBool,
    /// How often it has asked for that.
    pub(crate) restarts: AtomicUsize,
    /// Whether it is being activated.
    pub(crate) activating: AtomicBool,
    /// Whether it said that its latency has changed while it was not being activated, which the format forbids.
    pub(crate) untimely: AtomicBool,
    pub(crate) flush: AtomicBool,
    pub(crate) rescan: AtomicBool,
    pub(crate) closed: AtomicBool,
    /// Width in the lower half, height in the upper; 0 for none.
    resize: AtomicU64,
    pub(crate) preset: Reported,
    /// Kept for good, since the plugin may hold a reference; tracks change rarely.
    track: Mutex<Option<&'static Track>>,
    chosen: Mutex<Vec<(u32, MenuAction)>>,
}

fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the plugin says of the preset that it was asked to load: that it has, or why not.
#[derive(Default)]
pub(crate) struct Reported(Mutex<Option<Result<(), String>>>);

impl Reported {
    fn put(&self, report: Result<(), String>) {
        *held(&self.0) = Some(report);
    }

    pub(crate) fn take(&self) -> Option<Result<(), String>> {
        held(&self.0).take()
    }
}

impl Requests {
    pub(crate) fn new(editors: bool) -> Self {
        let no = || AtomicBool::new(false);
        let owner = thread::current().id();
        let (resize, preset) = (AtomicU64::new(0), Reported::default());
        Self {
            owner,
            audio: no(),
            editors,
            callback: no(),
            restart: no(),
            restarts: AtomicUsize::new(0),
            activating: no(),
            untimely: no(),
            flush: no(),
            rescan: no(),
            closed: no(),
            resize,
            preset,
            track: Mutex::default(),
            chosen: Mutex::default(),
        }
    }

    /// Plays the audio thread for what is done.
    pub(crate) fn on_audio_thread<R>(&self, done: impl FnOnce() -> R) -> R {
        self.audio.store(true, Ordering::Release);
        let result = done();
        self.audio.store(false, Ordering::Release);
        result
    }

    pub(crate) fn take(asked: &AtomicBool) -> bool {
        asked.swap(false, Ordering::AcqRel)
    }

    pub(crate) fn set_track(&self, track: Track) {
        *held(&self.track) = Some(Box::leak(Box::new(track)));
    }

    pub(crate) fn take_chosen(&self) -> Vec<(u32, MenuAction)> {
        std::mem::take(&mut held(&self.chosen))
    }

    pub(crate) fn take_resize(&self) -> Option<GuiSize> {
        let packed = self.resize.swap(0, Ordering::AcqRel);
        (packed != 0).then(|| GuiSize::unpack_from_u64(packed))
    }
}

/// Called from any thread.
pub(crate) struct Shared(pub(crate) Arc<Requests>);

/// Called on the main thread.
pub(crate) struct Main(pub(crate) Arc<Requests>);

pub(crate) struct Handlers;

impl HostHandlers for Handlers {
    type Shared<'a> = Shared;
    type MainThread<'a> = Main;
    type AudioProcessor<'a> = ();

    fn declare_extensions(builder: &mut HostExtensions<Self>, shared: &Self::Shared<'_>) {
        if shared.0.editors {
            builder.register::<HostGui>();
        }
        builder.register::<HostLatency>().register::<HostParams>().register::<HostPresetLoad>();
        builder.register::<HostState>().register::<HostThreadCheck>();
        builder.register::<HostContextMenu>().register::<HostTrackInfo>();
    }
}

impl SharedHandler<'_> for Shared {
    /// It is done when somebody asks for the latency: in the middle of a rendering it would cut the sound.
    fn request_restart(&self) {
        self.0.restarts.fetch_add(1, Ordering::AcqRel);
        self.0.restart.store(true, Ordering::Release);
    }

    /// It always processes.
    fn request_process(&self) {}

    fn request_callback(&self) {
        self.0.callback.store(true, Ordering::Release);
    }
}

impl MainThreadHandler<'_> for Main {}

impl HostThreadCheckImpl for Shared {
    fn is_main_thread(&self) -> bool {
        thread::current().id() == self.0.owner && !self.0.audio.load(Ordering::Acquire)
    }

    fn is_audio_thread(&self) -> bool {
        thread::current().id() == self.0.owner && self.0.audio.load(Ordering::Acquire)
    }
}

impl HostParamsImplShared for Shared {
    fn request_flush(&self) {
        self.0.flush.store(true, Ordering::Release);
    }
}

impl HostParamsImplMainThread for Main {
    fn rescan(&self, flags: ParamRescanFlags) {
        // Values are asked for when they are wanted.
        if flags != ParamRescanFlags::VALUES {
            self.0.rescan.store(true, Ordering::Release);
        }
    }

    fn clear(&self, _id: ClapId, _flags: ParamClearFlags) {}
}

impl HostLatencyImpl for Main {
    /// The latency is asked for when it is wanted.
    fn changed(&self) {
        if !self.0.activating.load(Ordering::Acquire) {
            self.0.untimely.store(true, Ordering::Release);
        }
    }
}

impl HostPresetLoadImpl for Main {
    fn on_error(&self, _location: Location, _key: Option<&CStr>, _os_error: i32, message: Option<&CStr>) {
        self.0.preset.put(Err(message.unwrap_or(c"without a reason").to_string_lossy().into_owned()));
    }

    fn loaded(&self, _location: Location, _key: Option<&CStr>) {
        self.0.preset.put(Ok(()));
    }
}

impl HostTrackInfoImpl for Main {
    fn get<'a>(&'a self, writer: &mut TrackInfoWriter<'_, 'a>) {
        let track = *held(&self.0.track);
        if let Some(&Track { ref name, colour: [red, green, blue] }) = track {
            let colour = Color { alpha: 255, red, green, blue };
            let mut info = TrackInfo::new().with_name(Some(name.as_bytes()));
            info.set_color(Some(colour));
            writer.set(&info);
        }
    }
}

impl HostContextMenuImpl for Main {
    fn populate(&self, target: ContextMenuTarget, builder: &mut ContextMenuBuilder) -> Result<(), HostError> {
        let ContextMenuTarget::Param(_) = target else { return Ok(()) };
        let entry =
            |label, action: MenuAction, enabled| Item::Entry { label, enabled, action_id: ClapId::new(action.number()) };
        let read = ClapId::new(MenuAction::ReadAutomation.number());
        for item in [
            Item::Title { title: c"Host", enabled: true },
            entry(c"Show automation", MenuAction::ShowAutomation, true),
            Item::CheckEntry { label: c"Read automation", enabled: true, checked: true, action_id: read },
            Item::Separator,
            Item::BeginSubmenu { label: c"MIDI", enabled: true },
            entry(c"Learn", MenuAction::MidiLearn, true),
            entry(c"Forget", MenuAction::MidiForget, false),
            Item::EndSubmenu,
        ] {
            builder.add_item(&item)?;
        }
        Ok(())
    }

    fn perform(&self, target: ContextMenuTarget, action: ClapId) -> Result<(), HostError> {
        let (ContextMenuTarget::Param(id), Some(action)) = (target, MenuAction::of(action.get())) else {
            return Err(HostError::Message("there is no such line in the menu"));
        };
        held(&self.0.chosen).push((id.get(), action));
        Ok(())
    }

    /// It has no windows of its own.
    fn can_popup(&self) -> bool {
        false
    }

    fn popup(&self, _target: ContextMenuTarget, _screen: i32, _x: i32, _y: i32) -> Result<(), HostError> {
        Err(HostError::Message("this host has no menu of its own"))
    }
}

impl HostStateImpl for Main {
    fn mark_dirty(&self) {}
}

impl HostGuiImpl for Shared {
    fn resize_hints_changed(&self) {}

    fn request_resize(&self, size: GuiSize) -> Result<(), HostError> {
        self.0.resize.store(size.pack_to_u64(), Ordering::Release);
        Ok(())
    }

    fn request_show(&self) -> Result<(), HostError> {
        Err(HostError::Message("the window is shown by whoever opened it"))
    }

    fn request_hide(&self) -> Result<(), HostError> {
        Err(HostError::Message("the window is hidden by whoever opened it"))
    }

    fn closed(&self, was_destroyed: bool) {
        if was_destroyed {
            self.0.closed.store(true, Ordering::Release);
        }
    }
}
