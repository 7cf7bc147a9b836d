//! The editor's window as the framework opens, sizes and closes it.

use super::app::App;
use super::ctx::Instance;
use super::geometry::Geometry;
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
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// A window's thread is not waited for longer.
const LONGEST_END: Duration = Duration::from_secs(5);

/// Opens an instance's editor as often as the host likes. What an open one needs goes with its window.
pub struct PromenadeEditor {
    instance: Instance,
    geometry: Arc<Geometry>,
}

impl PromenadeEditor {
    /// The editor of an instance; nothing is opened yet.
    #[must_use]
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

    fn spawn(
        &self,
        parent: Option<ParentWindowHandle>,
        wait_for_parent: bool,
        fallback_scale_factor: Option<f64>,
        gui_context: GuiContext,
        host: Option<HostMethods>,
    ) -> Result<SpawnedEditor<Self::Handle>, Box<dyn Error>> {
        let EditorSettings { width, height, zoom, .. } = self.settings();
        let state = EguiEditorState::from_size(LogicalSize::new(width, height), zoom);
        let settings = EguiNiceSettings::new()
            .with_tile("Promenade")
            .with_resize_hint(self.resize_hint())
            .with_repaint_poll_interval(Duration::from_millis(16));
        let (thread, ended) = channel();
        let app = App::new(self.instance.clone(), Arc::clone(&self.geometry), thread);
        // The framework's editor lives only as long as this call: window and handle own all that it made.
        let editor = create_egui_editor(state, RepaintNotifier::new(), settings, app).ok_or("no editor")?;
        let SpawnedEditor { handle, window } =
            editor.spawn(parent, wait_for_parent, fallback_scale_factor, gui_context, host)?;
        let handle = PromenadeHandle { inner: handle, geometry: Arc::clone(&self.geometry), shown: AtomicBool::new(false) };
        Ok(SpawnedEditor { handle, window: PromenadeWindow { window: Some(window), ended } })
    }

    fn track_info_updated(&self, info: TrackInfo) {
        // A colour that cannot be seen is none.
        let colour = info.color().map(TrackColor::rgba).filter(|(.., alpha)| *alpha > 0).map(|(r, g, b, _)| [r, g, b]);
        self.instance.host_side.set_track(Track { name: info.name().to_owned(), colour });
    }

    fn size(&self) -> NativeSize<u32> {
        let held = self.geometry.held();
        let scale = held.scale.unwrap_or(1.0);
        match held.open {
            Some((width, height)) => NativeSize::from_size(PhysicalSize::new(width, height).into(), scale),
            None => {
                let EditorSettings { width, height, zoom, .. } = self.settings();
                NativeSize::from_size(LogicalSize::new(width * zoom, height * zoom).into(), scale)
            }
        }
    }

    fn resize_hint(&self) -> ResizeHint {
        ResizeHint::resizable().with_min_logical_size(LogicalSize::new(LEAST_SIZE.0, LEAST_SIZE.1))
    }
}

/// The window of an open editor. When it is dropped its thread has ended.
///
/// The window library asks the thread for an answer after it has told it to end, and goes its way when none comes. What the
/// thread still had to do then ran beside the next window's beginning, or the end of the process.
pub struct PromenadeWindow {
    window: Option<baseview::Window>,
    /// Disconnected when the thread has ended.
    ended: Receiver<()>,
}

impl PromenadeWindow {
    fn with(&self, done: impl FnOnce(&baseview::Window) -> Result<(), baseview::Error>) -> Result<(), baseview::Error> {
        self.window.as_ref().map_or(Ok(()), done)
    }
}

impl Drop for PromenadeWindow {
    fn drop(&mut self) {
        drop(self.window.take());
        if self.ended.recv_timeout(LONGEST_END) == Err(RecvTimeoutError::Timeout) {
            nice_warn!("the editor's window takes long to close");
        }
    }
}

/// An open editor.
pub struct PromenadeHandle {
    inner: EguiEditorHandle,
    geometry: Arc<Geometry>,
    /// Whether the window was brought up: before, no picture may be asked for.
    shown: AtomicBool,
}

impl EditorHandle for PromenadeHandle {
    type Window = PromenadeWindow;
    type Error = baseview::Error;

    fn run_until_closed(mut window: Self::Window) -> Result<(), Self::Error> {
        window.window.take().map_or(Ok(()), baseview::Window::run_until_closed)
    }

    fn set_parent(&self, parent: ParentWindowHandle, window: &Self::Window) -> Result<(), Self::Error> {
        window.with(|window| self.inner.set_parent(parent, window))
    }

    fn show(&self, window: &Self::Window) -> Result<(), Self::Error> {
        let shown = window.with(|window| self.inner.show(window));
        self.shown.store(true, Ordering::Release);
        shown
    }

    fn hide(&self, window: &Self::Window) -> Result<(), Self::Error> {
        window.with(|window| self.inner.hide(window))
    }

    fn set_size(&self, new_size: NativeSize<u32>, window: &Self::Window) -> Result<(), Self::Error> {
        window.with(|window| self.inner.set_size(new_size, window))
    }

    fn host_main_thread_callback(&self, window: &Self::Window) {
        if let Some(window) = &window.window {
            self.inner.host_main_thread_callback(window);
        }
    }

    fn adjust_size(&self, new_size: NativeSize<u32>, window: &Self::Window) -> Option<NativeSize<u32>> {
        window.window.as_ref().and_then(|window| self.inner.adjust_size(new_size, window))
    }

    fn set_fallback_scale_factor(&self, scale_factor: f64, window: &Self::Window) -> Result<(), Self::Error> {
        self.geometry.held().scale = Some(scale_factor);
        window.with(|window| self.inner.set_fallback_scale_factor(scale_factor, window))
    }

    /// Keys that a text field needs are kept from the host's own shortcuts.
    fn on_virtual_key_from_host(&self, _key_code: VirtualKeyCode, _is_down: bool, _modifiers: Modifiers) -> bool {
        self.geometry.held().typing
    }

    fn state_changed(&self) {
        if self.shown.load(Ordering::Acquire) {
            self.inner.state_changed();
        }
    }

    fn param_value_changed(&self, id: &str, normalized_value: f32) {
        if self.shown.load(Ordering::Acquire) {
            self.inner.param_value_changed(id, normalized_value);
        }
    }

    fn param_modulation_changed(&self, id: &str, modulation_offset: f32) {
        if self.shown.load(Ordering::Acquire) {
            self.inner.param_modulation_changed(id, modulation_offset);
        }
    }
}
