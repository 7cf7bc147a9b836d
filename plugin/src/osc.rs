//! Open Sound Control: head trackers and remote control in, the listener's pose out.

pub mod config;
pub mod inbox;

pub use config::{AxisMap, Interface, OscConfig, OscOut, TrackerFormat};
pub use inbox::Inbox;
