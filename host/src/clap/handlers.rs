//! What a CLAP plugin asks its host for.

use clack_extensions::gui::{GuiSize, HostGui, HostGuiImpl};
use clack_extensions::latency::{HostLatency, HostLatencyImpl};
use clack_extensions::params::{HostParams, HostParamsImplMainThread, HostParamsImplShared, ParamClearFlags, ParamRescanFlags};
use clack_extensions::preset_discovery::HostPresetLoadImpl;
use clack_extensions::preset_discovery::prelude::{HostPresetLoad, Location};
use clack_extensions::state::{HostState, HostStateImpl};
use clack_extensions::thread_check::{HostThreadCheck, HostThreadCheckImpl};
use clack_host::prelude::*;
use std::ffi::CStr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
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
    pub(crate) flush: AtomicBool,
    pub(crate) rescan: AtomicBool,
    pub(crate) closed: AtomicBool,
    /// Width in the lower half, height in the upper; 0 for none.
    resize: AtomicU64,
    pub(crate) preset: Reported,
}

/// What the plugin says of the preset that it was asked to load: that it has, or why not.
#[derive(Default)]
pub(crate) struct Reported(Mutex<Option<Result<(), String>>>);

impl Reported {
    fn put(&self, report: Result<(), String>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(report);
    }

    pub(crate) fn take(&self) -> Option<Result<(), String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Requests {
    pub(crate) fn new(editors: bool) -> Self {
        let no = || AtomicBool::new(false);
        let owner = thread::current().id();
        let (resize, preset) = (AtomicU64::new(0), Reported::default());
        Self { owner, audio: no(), editors, callback: no(), flush: no(), rescan: no(), closed: no(), resize, preset }
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
    }
}

impl SharedHandler<'_> for Shared {
    /// A restart is up to who plays the instance: in the middle of a rendering it would cut the sound.
    fn request_restart(&self) {}

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
    fn changed(&self) {}
}

impl HostPresetLoadImpl for Main {
    fn on_error(&self, _location: Location, _key: Option<&CStr>, _os_error: i32, message: Option<&CStr>) {
        self.0.preset.put(Err(message.unwrap_or(c"without a reason").to_string_lossy().into_owned()));
    }

    fn loaded(&self, _location: Location, _key: Option<&CStr>) {
        self.0.preset.put(Ok(()));
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
