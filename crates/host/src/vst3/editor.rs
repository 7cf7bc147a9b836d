//! A VST3 plugin's editor inside an X11 window.

use super::Vst3Plugin;
use crate::Fault;
use crate::editor::{Editor, EditorSize, Opening};

/// The editor of a plugin that has one, where there is X11.
pub(crate) fn of(plugin: &mut Vst3Plugin) -> Option<&mut dyn Editor> {
    (cfg!(target_os = "linux") && plugin.plugin.has_editor()).then_some(plugin)
}

fn size_of((width, height): (i32, i32)) -> EditorSize {
    EditorSize { width: u32::try_from(width).unwrap_or(0), height: u32::try_from(height).unwrap_or(0) }
}

impl Vst3Plugin {
    fn name_scale(&mut self, scale: f64) -> Result<(), Fault> {
        #[expect(clippy::cast_possible_truncation, reason = "a factor near 1")]
        let scale = scale as f32;
        // Who declines has its own idea of the scale.
        self.plugin.set_editor_scale_factor(scale).map(drop).map_err(|e| self.failed("scale its editor", e))
    }

    #[cfg(target_os = "linux")]
    fn attach(&mut self, window: u32) -> Result<(), Fault> {
        let opened = self.plugin.open_editor(vst3_host::WindowHandle::from_x11(window));
        opened.map_err(|e| self.failed("open its editor", e))
    }

    #[cfg(not(target_os = "linux"))]
    fn attach(&mut self, _window: u32) -> Result<(), Fault> {
        Err(self.failed("open its editor", "there is no X11"))
    }
}

impl Editor for Vst3Plugin {
    fn open_by(&mut self, Opening { window, scale, pause, .. }: Opening<'_>) -> Result<EditorSize, Fault> {
        // Before it is open, it is only remembered.
        self.name_scale(scale)?;
        pause();
        self.attach(window)?;
        pause();
        self.size()
    }

    fn is_open(&self) -> bool {
        self.plugin.is_editor_open()
    }

    fn size(&mut self) -> Result<EditorSize, Fault> {
        match self.plugin.attached_editor_size() {
            Ok(Some(size)) => Ok(size_of(size)),
            Ok(None) => Err(self.failed("report its editor's size", "it is not open")),
            Err(e) => Err(self.failed("report its editor's size", e)),
        }
    }

    fn can_resize(&mut self) -> bool {
        self.plugin.attached_editor_can_resize().unwrap_or(false)
    }

    fn resize(&mut self, size: EditorSize) -> Result<EditorSize, Fault> {
        let pixels = |count: u32| i32::try_from(count).unwrap_or(i32::MAX);
        let resized = self.plugin.resize_editor(pixels(size.width), pixels(size.height));
        resized.map(size_of).map_err(|e| self.failed("resize its editor", e))
    }

    fn rescale(&mut self, scale: f64) -> Result<EditorSize, Fault> {
        self.name_scale(scale)?;
        self.size()
    }

    fn take_resize_request(&mut self) -> Option<EditorSize> {
        self.plugin.take_editor_resize_request().map(size_of)
    }

    fn show(&mut self) -> Result<(), Fault> {
        self.size().map(drop)
    }

    fn hide(&mut self) -> Result<(), Fault> {
        Err(self.failed("hide its editor", "VST3 editors are open or closed"))
    }

    fn close(&mut self) -> Result<(), Fault> {
        self.plugin.close_editor().map_err(|e| self.failed("close its editor", e))
    }
}
