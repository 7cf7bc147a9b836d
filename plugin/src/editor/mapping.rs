//! A window is on the screen before its event loop begins.
//!
//! The window library asks the X server for the time of a picture whenever one is due, and waits for the answer before it asks
//! again; but it selects answers only when the window has come onto the screen. A picture that is due before, as by the first
//! timer where a machine is busy for its 16 ms, never comes. On a screen from the beginning, the window's first event is that.

use nice_plug_egui::baseview::WindowContext;

/// The number of a window that is being made.
#[cfg(target_os = "linux")]
pub(super) fn number(window: &WindowContext) -> Option<u32> {
    use raw_window_handle::{HasWindowHandle, RawWindowHandle};
    let handle = window.platform_handle();
    let Ok(RawWindowHandle::Xcb(handle)) = handle.window_handle().map(|handle| handle.as_raw()) else { return None };
    Some(handle.window.get())
}

/// Whether a window is on the screen, and so draws pictures.
#[cfg(target_os = "linux")]
pub(super) fn is_seen(number: u32) -> bool {
    use x11rb::protocol::xproto::{ConnectionExt, MapState};
    let state = || -> Result<MapState, Box<dyn std::error::Error>> {
        Ok(x11rb::connect(None)?.0.get_window_attributes(number)?.reply()?.map_state)
    };
    state().is_ok_and(|state| state == MapState::VIEWABLE)
}

/// Brings a window that is being made onto the screen.
#[cfg(target_os = "linux")]
pub(super) fn map(window: &WindowContext) {
    use x11rb::protocol::xproto::ConnectionExt;
    let Some(number) = number(window) else { return };
    // A connection of its own: the library's is not to be had, and the server has answered it for all that made the window.
    let mapped = || -> Result<(), Box<dyn std::error::Error>> {
        let (x11, _) = x11rb::connect(None)?;
        x11.map_window(number)?.check()?;
        Ok(())
    };
    if let Err(error) = mapped() {
        nice_plug::nice_warn!("the editor's window may stay blank: {error}");
    }
}

/// Elsewhere pictures do not wait for the window, and its end does not for pictures.
#[cfg(not(target_os = "linux"))]
pub(super) fn map(_window: &WindowContext) {}

#[cfg(not(target_os = "linux"))]
pub(super) fn number(_window: &WindowContext) -> Option<u32> {
    None
}

#[cfg(not(target_os = "linux"))]
pub(super) fn is_seen(_number: u32) -> bool {
    false
}
