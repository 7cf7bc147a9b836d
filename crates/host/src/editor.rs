//! A plugin's own window.

use crate::Fault;

/// Size of an editor, pixels of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EditorSize {
    /// Width.
    pub width: u32,
    /// Height.
    pub height: u32,
}

/// What a host says of an editor between making and showing it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EditorStep {
    /// The scale of logical to physical pixels.
    Scale,
    /// Asks for the size, and gives that very size.
    Size,
    /// Puts it into the host's window.
    Parent,
}

/// How an editor is opened. VST3 has the steps in an order of its own, and no time between them.
pub struct Opening<'a> {
    /// Number of the host's window, which must outlive the editor and be at least as big.
    pub window: u32,
    /// Logical to physical pixels. A plugin that has its own idea of it keeps to that.
    pub scale: f64,
    /// The steps in their order; [`EditorStep::Parent`] is one of them.
    pub steps: &'a [EditorStep],
    /// Called between any two calls of the plugin.
    pub pause: &'a mut dyn FnMut(),
}

/// A plugin's own window inside one of the host's, on X11.
///
/// While it is open [`Instance::serve`](crate::Instance::serve) is to be called some thirty times a second. All methods
/// belong to the thread that opened the instance. The editor closes with the instance.
pub trait Editor {
    /// Opens the editor inside a window, at a scale of logical to physical pixels; returns its size. A plugin that has its own
    /// idea of the scale keeps to it. The window must outlive the editor, and be at least as big.
    ///
    /// # Errors
    /// It is open already, or the plugin refuses the window.
    fn open(&mut self, window: u32, scale: f64) -> Result<EditorSize, Fault> {
        self.open_by(Opening { window, scale, steps: &[EditorStep::Scale, EditorStep::Parent], pause: &mut || () })
    }

    /// Opens the editor as some host does, step by step; returns its size.
    ///
    /// # Errors
    /// It is open already, or the plugin refuses a step.
    fn open_by(&mut self, opening: Opening<'_>) -> Result<EditorSize, Fault>;

    /// Whether it is open.
    fn is_open(&self) -> bool;

    /// The size as it is.
    ///
    /// # Errors
    /// It is not open, or the plugin does not say.
    fn size(&mut self) -> Result<EditorSize, Fault>;

    /// Whether the user may drag its border.
    fn can_resize(&mut self) -> bool;

    /// Asks for a size and gives the editor the nearest one that it accepts, which is returned.
    ///
    /// # Errors
    /// It is not open, or the plugin refuses.
    fn resize(&mut self, size: EditorSize) -> Result<EditorSize, Fault>;

    /// Names another scale of logical to physical pixels; returns the size at it. A plugin that has its own idea of the scale
    /// keeps to that.
    ///
    /// # Errors
    /// It is not open, or the plugin does not say its size.
    fn rescale(&mut self, scale: f64) -> Result<EditorSize, Fault>;

    /// The size that the plugin has asked for since this was last called; the host gives it by [`Editor::resize`].
    fn take_resize_request(&mut self) -> Option<EditorSize>;

    /// Shows what was hidden. A VST3 editor is always shown while it is open.
    ///
    /// # Errors
    /// It is not open, or the plugin refuses.
    fn show(&mut self) -> Result<(), Fault>;

    /// Hides it and keeps it open.
    ///
    /// # Errors
    /// It is not open, the plugin refuses, or it is VST3, which has no hiding.
    fn hide(&mut self) -> Result<(), Fault>;

    /// Closes it; nothing happens where it is closed.
    ///
    /// # Errors
    /// The plugin does not let go of the window.
    fn close(&mut self) -> Result<(), Fault>;

    /// Lets go of it without closing it, as hosts do that end in a hurry: a CLAP plugin finds it open when it ends. A VST3
    /// editor is closed.
    ///
    /// # Errors
    /// The plugin does not take its editor out of the window.
    fn abandon(&mut self) -> Result<(), Fault> {
        self.close()
    }
}
