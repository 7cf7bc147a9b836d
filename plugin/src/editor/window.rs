//! The editor's window as the framework opens, sizes and closes it.

use super::{app::App, ctx::Instance, geometry::Geometry, mapping};
use crate::project::preferences::Preferences;
use crate::project::settings::{EditorSettings, LEAST_SIZE};
use crate::telemetry::host_side::Track;
use nice_plug::context::gui::GuiContext;
use nice_plug::editor::dpi::{LogicalSize, NativeSize, PhysicalSize};
use nice_plug::editor::{
    Editor, EditorHandle, HostMethods, Modifiers, ParentWindowHandle, ResizeHint, SpawnedEditor, VirtualKeyCode,
};
use nice_plug::nice_warn;
use nice_plug::prelude::{TrackColor, TrackInfo};
use nice_plug_egui::{EguiEditorHandle, EguiEditorState, EguiNiceSettings, RepaintNotifier, baseview, create_egui_editor};
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;
use thiserror::Error;

/// A window's thread is not waited for longer.
const LONGEST_END: Duration = Duration::from_secs(10);

/// Opens an instance's editor as often as the host likes. What an open one needs goes with its window.
pub struct PromenadeEditor {
    instance: Instance,
    geometry: Arc<Geometry>,
}

impl PromenadeEditor {
    /// The editor of an instance; nothing is opened yet.
    pub fn new(instance: Instance) -> Self {
        Self { instance, geometry: Arc::default() }
    }

    /// As the project keeps them.
    fn settings(&self) -> EditorSettings {
        self.instance.params.editor.get().0.within_reason()
    }
}

impl Editor for PromenadeEditor {
    type Handle = PromenadeHandle;

    /// Opens the window, or with `wait_for_parent` notes how to: before it is to be shown there is none.
    fn spawn(
        &self,
        parent: Option<ParentWindowHandle>,
        wait_for_parent: bool,
        fallback_scale_factor: Option<f64>,
        gui_context: GuiContext,
        host: Option<HostMethods>,
    ) -> Result<SpawnedEditor<Self::Handle>, Box<dyn std::error::Error>> {
        let EditorSettings { width, height, .. } = self.settings();
        let own = Preferences::read().scale;
        // What was noted of a window that was never shown.
        self.geometry.closed();
        let scale = fallback_scale_factor.or_else(|| self.instance.host_side.scale());
        if scale.is_some() {
            self.geometry.held().scale = scale;
        }
        let (instance, geometry, hint) = (self.instance.clone(), Arc::clone(&self.geometry), self.resize_hint());
        let (notifier, shape) = (RepaintNotifier::new(), Arc::clone(&self.geometry));
        let [theirs, asking] = [notifier.clone(), notifier.clone()];
        let open = move |parent: Option<ParentWindowHandle>, scale: Option<f64>| {
            let state = EguiEditorState::from_size(LogicalSize::new(width, height), own);
            let settings = EguiNiceSettings::new()
                .with_tile("Promenade")
                .with_resize_hint(hint)
                .with_repaint_poll_interval(Duration::from_millis(16));
            let (thread, ended) = channel();
            let app = App::new(instance, geometry, thread);
            // The framework's editor lives only as long as this call: window and handle own all that it made.
            let editor = create_egui_editor(state, theirs, settings, app).ok_or("no editor")?;
            let SpawnedEditor { handle, window } = editor.spawn(parent, false, scale, gui_context, host)?;
            // The window library makes the window as if the host had named no scale, and draws at that scale.
            let now = window.size();
            let wanted = LogicalSize::new(f64::from(width * own), f64::from(height * own)).to_physical(now.scale_factor);
            if now.physical != wanted {
                handle.set_size(NativeSize::from_size(wanted.into(), now.scale_factor), &window)?;
            }
            Ok(Opened { geometry: shape, notifier: asking, handle, window: Some(window), ended })
        };
        let stage = if wait_for_parent {
            Stage::Waiting(Waiting { open: Box::new(open), parent, scale, size: None })
        } else {
            Stage::Open(open(parent, scale)?)
        };
        let handle = PromenadeHandle { geometry: Arc::clone(&self.geometry), hint, notifier, shown: AtomicBool::new(false) };
        Ok(SpawnedEditor { handle, window: PromenadeWindow { stage: RefCell::new(stage) } })
    }

    fn track_info_updated(&self, info: TrackInfo) {
        // A colour that cannot be seen is none.
        let colour = info.color().map(TrackColor::rgba).filter(|(.., alpha)| *alpha > 0).map(|(r, g, b, _)| [r, g, b]);
        self.instance.host_side.set_track(Track { name: info.name().to_owned(), colour });
    }

    fn size(&self) -> NativeSize<u32> {
        let held = self.geometry.held();
        let named = self.instance.host_side.scale().filter(|_| held.open.is_none());
        let scale = named.or(held.scale).unwrap_or(1.0);
        match held.open {
            Some((width, height)) => NativeSize::from_size(PhysicalSize::new(width, height).into(), scale),
            None => {
                let EditorSettings { width, height, .. } = self.settings();
                let own = Preferences::read().scale;
                NativeSize::from_size(LogicalSize::new(width * own, height * own).into(), scale)
            }
        }
    }

    fn resize_hint(&self) -> ResizeHint {
        ResizeHint::resizable().with_min_logical_size(LogicalSize::new(LEAST_SIZE.0, LEAST_SIZE.1))
    }
}

/// Opens a window inside another one, at a scale.
type Open = dyn FnOnce(Option<ParentWindowHandle>, Option<f64>) -> Result<Opened, Box<dyn std::error::Error>>;

/// Why an editor cannot do what its host asks for.
#[derive(Debug, Error)]
pub enum EditorError {
    /// The window library says why.
    #[error(transparent)]
    Window(#[from] baseview::Error),
    /// The window cannot be opened.
    #[error("the editor's window cannot be opened: {0}")]
    Open(String),
    /// There is no window any more.
    #[error("the editor's window is gone")]
    Gone,
}

/// The window of an editor, from the time on that it is shown.
///
/// The window library asks the screen for the time of a picture, and waits for the answer before it asks again. An answer to a
/// window that is not on the screen never comes: what a host does slowly, between making an editor and showing it, left the
/// window blank for good. So it is made when it is shown, and is on the screen from its beginning on ([`App`]'s `build`).
pub struct PromenadeWindow {
    stage: RefCell<Stage>,
}

enum Stage {
    Waiting(Waiting),
    Open(Opened),
    /// It could not be opened, or has ended.
    Gone,
}

/// What the host has said of a window before it is shown.
struct Waiting {
    open: Box<Open>,
    parent: Option<ParentWindowHandle>,
    scale: Option<f64>,
    size: Option<NativeSize<u32>>,
}

/// A window that is there. When it is dropped its thread has ended.
///
/// The window library asks the thread for an answer after it has told it to end, goes its way when none comes, and writes a
/// warning into the host's log. What the thread still had to do then ran beside the next window's beginning, or the end of the
/// process. So the thread is asked to end by itself first, which one that draws no more does not hear.
struct Opened {
    geometry: Arc<Geometry>,
    notifier: RepaintNotifier,
    handle: EguiEditorHandle,
    window: Option<baseview::Window>,
    /// Disconnected when the thread has ended.
    ended: Receiver<()>,
}

impl Opened {
    fn with(
        &self,
        done: impl FnOnce(&EguiEditorHandle, &baseview::Window) -> Result<(), baseview::Error>,
    ) -> Result<(), EditorError> {
        self.window.as_ref().map_or(Err(EditorError::Gone), |window| done(&self.handle, window).map_err(EditorError::from))
    }
}

impl Drop for Opened {
    fn drop(&mut self) {
        self.geometry.held().closing = true;
        self.notifier.request_repaint();
        // Elsewhere a window has no thread of its own.
        let ends_late = || cfg!(target_os = "linux") && self.ended.recv_timeout(LONGEST_END) == Err(RecvTimeoutError::Timeout);
        // What is seen ends by itself with its next picture, however late; what is not seen draws none.
        let window = self.geometry.held().window;
        let _ended = window.is_some_and(mapping::is_seen) && ends_late();
        drop(self.window.take());
        if ends_late() {
            nice_warn!("the editor's window takes long to close");
        }
    }
}

impl PromenadeWindow {
    /// Does something to a window that is there, or notes it for one that is not.
    fn with(
        &self,
        note: impl FnOnce(&mut Waiting),
        done: impl FnOnce(&EguiEditorHandle, &baseview::Window) -> Result<(), baseview::Error>,
    ) -> Result<(), EditorError> {
        match &mut *self.stage.borrow_mut() {
            Stage::Waiting(waiting) => {
                note(waiting);
                Ok(())
            }
            Stage::Open(opened) => opened.with(done),
            Stage::Gone => Err(EditorError::Gone),
        }
    }

    /// Opens what waits, as it was noted.
    fn open(&self) -> Result<(), EditorError> {
        let stage = std::mem::replace(&mut *self.stage.borrow_mut(), Stage::Gone);
        let opened = match stage {
            Stage::Waiting(Waiting { open, parent, scale, size }) => {
                let opened = open(parent, scale).map_err(|error| EditorError::Open(error.to_string()))?;
                if let Some(size) = size {
                    opened.with(|handle, window| handle.set_size(size, window))?;
                }
                opened
            }
            Stage::Open(opened) => opened,
            Stage::Gone => return Err(EditorError::Gone),
        };
        *self.stage.borrow_mut() = Stage::Open(opened);
        Ok(())
    }
}

/// An editor that its host holds.
pub struct PromenadeHandle {
    geometry: Arc<Geometry>,
    hint: ResizeHint,
    notifier: RepaintNotifier,
    /// Whether the window was brought up: before, no picture may be asked for.
    shown: AtomicBool,
}

impl PromenadeHandle {
    fn repaint(&self) {
        if self.shown.load(Ordering::Acquire) {
            self.notifier.request_repaint();
        }
    }
}

impl EditorHandle for PromenadeHandle {
    type Window = PromenadeWindow;
    type Error = EditorError;

    fn run_until_closed(window: Self::Window) -> Result<(), Self::Error> {
        window.open()?;
        let Stage::Open(mut opened) = window.stage.into_inner() else { return Err(EditorError::Gone) };
        opened.window.take().map_or(Ok(()), baseview::Window::run_until_closed).map_err(EditorError::from)
    }

    fn set_parent(&self, parent: ParentWindowHandle, window: &Self::Window) -> Result<(), Self::Error> {
        window.with(|waiting| waiting.parent = Some(parent), |handle, window| handle.set_parent(parent, window))
    }

    fn show(&self, window: &Self::Window) -> Result<(), Self::Error> {
        window.open()?;
        let shown = window.with(|_| (), |handle, window| handle.show(window));
        self.shown.store(true, Ordering::Release);
        shown
    }

    fn hide(&self, window: &Self::Window) -> Result<(), Self::Error> {
        window.with(|_| (), |handle, window| handle.hide(window))
    }

    fn set_size(&self, new_size: NativeSize<u32>, window: &Self::Window) -> Result<(), Self::Error> {
        if let Stage::Waiting(_) = &*window.stage.borrow() {
            // Hosts may ask for it before there is a window.
            self.geometry.held().open = Some((new_size.width, new_size.height));
        }
        window.with(|waiting| waiting.size = Some(new_size), |handle, window| handle.set_size(new_size, window))
    }

    fn host_main_thread_callback(&self, window: &Self::Window) {
        let called = window.with(
            |_| (),
            |handle, window| {
                handle.host_main_thread_callback(window);
                Ok(())
            },
        );
        if let Err(error) = called {
            nice_warn!("{error}");
        }
    }

    fn adjust_size(&self, new_size: NativeSize<u32>, window: &Self::Window) -> Option<NativeSize<u32>> {
        match &*window.stage.borrow() {
            Stage::Open(Opened { handle, window: Some(window), .. }) => handle.adjust_size(new_size, window),
            _ => Some(self.hint.adjust_size(new_size, new_size, self.geometry.held().scale.unwrap_or(1.0))),
        }
    }

    fn set_fallback_scale_factor(&self, scale_factor: f64, window: &Self::Window) -> Result<(), Self::Error> {
        self.geometry.held().scale = Some(scale_factor);
        window.with(
            |waiting| waiting.scale = Some(scale_factor),
            |handle, window| handle.set_fallback_scale_factor(scale_factor, window),
        )
    }

    /// Keys that a text field needs are kept from the host's own shortcuts.
    fn on_virtual_key_from_host(&self, _key_code: VirtualKeyCode, _is_down: bool, _modifiers: Modifiers) -> bool {
        self.geometry.held().typing
    }

    fn state_changed(&self) {
        self.repaint();
    }

    fn param_value_changed(&self, _id: &str, _normalized_value: f32) {
        self.repaint();
    }

    fn param_modulation_changed(&self, _id: &str, _modulation_offset: f32) {
        self.repaint();
    }
}
