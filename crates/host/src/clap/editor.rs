//! A CLAP plugin's editor inside an X11 window.

use super::ClapPlugin;
use crate::Fault;
use crate::editor::{Editor, EditorSize, EditorStep, Opening};
use clack_extensions::gui::{GuiApiType, GuiConfiguration, GuiSize, PluginGui, Window};

const EMBEDDED: GuiConfiguration<'static> = GuiConfiguration { api_type: GuiApiType::X11, is_floating: false };

/// The editor of a plugin that has one for X11.
pub(crate) fn of(plugin: &mut ClapPlugin) -> Option<&mut dyn Editor> {
    let gui = plugin.instance.plugin_handle().get_extension::<PluginGui>()?;
    gui.is_api_supported(&plugin.instance.plugin_handle(), EMBEDDED).then_some(plugin)
}

impl From<GuiSize> for EditorSize {
    fn from(size: GuiSize) -> Self {
        Self { width: size.width, height: size.height }
    }
}

impl ClapPlugin {
    pub(super) fn destroy_editor(&mut self) {
        if std::mem::take(&mut self.editor_open)
            && let Ok(gui) = self.gui()
        {
            gui.destroy(&self.instance.plugin_handle());
        }
    }

    fn gui(&mut self) -> Result<PluginGui, Fault> {
        self.extension::<PluginGui>("editor")
    }

    /// Takes the steps from making an editor to showing it.
    fn show_by(&mut self, gui: PluginGui, Opening { window, scale, steps, pause }: Opening<'_>) -> Result<(), Fault> {
        for step in steps {
            pause();
            let handle = self.instance.plugin_handle();
            let done = match step {
                EditorStep::Scale => {
                    // Who declines has its own idea of the scale.
                    let _ = gui.set_scale(&handle, scale);
                    Ok(())
                }
                EditorStep::Size => gui.get_size(&handle).map_or(Ok(()), |size| {
                    pause();
                    gui.set_size(&handle, size)
                }),
                #[expect(unsafe_code, reason = "a window is only a number")]
                // SAFETY: the caller keeps the window until the editor is closed, as `Opening` asks.
                EditorStep::Parent => unsafe { gui.set_parent(&handle, Window::from_x11_handle(window.into())) },
            };
            done.map_err(|e| self.failed("open its editor", e))?;
        }
        pause();
        let shown = gui.show(&self.instance.plugin_handle());
        shown.map_err(|e| self.failed("show its editor", e))
    }

    fn open_gui(&mut self) -> Result<PluginGui, Fault> {
        if self.editor_open { self.gui() } else { Err(self.failed("use its editor", "it is not open")) }
    }
}

impl Editor for ClapPlugin {
    fn open_by(&mut self, opening: Opening<'_>) -> Result<EditorSize, Fault> {
        if self.editor_open {
            return Err(self.failed("open its editor", "it is open already"));
        }
        let gui = self.gui()?;
        gui.create(&self.instance.plugin_handle(), EMBEDDED).map_err(|e| self.failed("make its editor", e))?;
        self.editor_open = true;
        let shown = self.show_by(gui, opening);
        if shown.is_err() {
            self.destroy_editor();
        }
        shown?;
        self.size()
    }

    fn is_open(&self) -> bool {
        self.editor_open
    }

    fn size(&mut self) -> Result<EditorSize, Fault> {
        let gui = self.open_gui()?;
        let size = gui.get_size(&self.instance.plugin_handle());
        size.map(EditorSize::from).ok_or_else(|| self.failed("report its editor's size", "it has none"))
    }

    fn can_resize(&mut self) -> bool {
        let gui = self.open_gui();
        gui.is_ok_and(|gui| gui.can_resize(&self.instance.plugin_handle()))
    }

    fn resize(&mut self, size: EditorSize) -> Result<EditorSize, Fault> {
        let gui = self.open_gui()?;
        let handle = self.instance.plugin_handle();
        let wanted = GuiSize { width: size.width, height: size.height };
        let accepted = gui.adjust_size(&handle, wanted).unwrap_or(wanted);
        let done = gui.set_size(&handle, accepted);
        done.map(|()| accepted.into()).map_err(|e| self.failed("resize its editor", e))
    }

    fn rescale(&mut self, scale: f64) -> Result<EditorSize, Fault> {
        let gui = self.open_gui()?;
        // Who declines has its own idea of the scale.
        let _ = gui.set_scale(&self.instance.plugin_handle(), scale);
        self.size()
    }

    fn take_resize_request(&mut self) -> Option<EditorSize> {
        self.requests.take_resize().map(EditorSize::from)
    }

    fn show(&mut self) -> Result<(), Fault> {
        let gui = self.open_gui()?;
        let done = gui.show(&self.instance.plugin_handle());
        done.map_err(|e| self.failed("show its editor", e))
    }

    fn hide(&mut self) -> Result<(), Fault> {
        let gui = self.open_gui()?;
        let done = gui.hide(&self.instance.plugin_handle());
        done.map_err(|e| self.failed("hide its editor", e))
    }

    fn close(&mut self) -> Result<(), Fault> {
        self.destroy_editor();
        Ok(())
    }

    fn abandon(&mut self) -> Result<(), Fault> {
        self.editor_open = false;
        Ok(())
    }
}
