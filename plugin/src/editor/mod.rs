//! The editor: what the instance hears and how, to see and to take hold of.
//!
//! It runs on the thread of its window, reads the audio thread's telemetry, and writes parameters as automation gestures
//! through the host. Nothing of it exists while no window is open.

mod accuracy;
mod app;
mod banner;
mod budget;
mod chooser;
pub mod controls;
pub mod ctx;
mod direct_panel;
mod direction;
mod drawer;
mod dropped;
mod estimate;
mod file_row;
mod geometry;
pub mod gesture;
mod header;
pub mod host;
mod host_menu;
mod loudness;
mod mapping;
pub mod meter;
mod osc_panel;
pub mod panel;
mod path_panel;
mod plot;
pub mod pose_source;
mod presets;
mod pump;
mod quality_panel;
mod response_panel;
mod room_panel;
mod scenes;
mod side;
mod sound_panel;
mod source_path;
mod sources_panel;
mod t20;
pub mod theme;
mod timeline;
mod view;
pub mod views;
pub mod widgets;
mod window;
pub mod words;

pub use ctx::{Ctx, Instance, Selection};
pub use panel::Panel;
pub use window::PromenadeEditor;
