//! The editor: what the instance hears and how, to see and to take hold of.
//!
//! It runs on the thread of its window, reads the audio thread's telemetry, and writes parameters as automation gestures through the
//! host. Nothing of it exists while no window is open.

mod app;
pub mod ctx;
mod ears_panel;
pub mod gesture;
mod header;
pub mod host;
pub mod knobs;
mod osc_panel;
pub mod panel;
mod path_panel;
mod presets_panel;
mod side;
mod tabs;
pub mod theme;
mod view;
pub mod widgets;
mod window;

pub use ctx::{Ctx, Instance, Selection};
pub use panel::Panel;
pub use window::PromenadeEditor;
