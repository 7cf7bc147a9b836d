//! Loads CLAP and VST3 plugins, anybody's, as a host does, and renders sound through them without a screen.
//!
//! A [`Bundle`] is a file or folder with plugins, loaded once; an [`Instance`] is one running plugin of it. There may be any
//! number of either in a process, each with a [`Setup`] of its own. [`Bounce`] renders sound in time with its input, with
//! automation that is accurate to the sample.
//!
//! ```no_run
//! use promenade_host::{Bundle, Setup};
//!
//! # fn main() -> Result<(), promenade_host::Fault> {
//! let bundle = Bundle::load("Promenade.clap".as_ref())?;
//! let mut plugin = bundle.open(Setup { offline: true, ..Setup::default() })?;
//! let yaw = plugin.parameter("Yaw")?.id;
//! let left = plugin.from_text(yaw, "60 deg")?;
//! plugin.set_at(yaw, left, 0)?;
//! let [_left_ear, _right_ear] = plugin.process(&[&[0.5; 512], &[0.5; 512]])?;
//! # Ok(())
//! # }
//! ```
//!
//! # Trust
//!
//! A plugin is code and runs in this process: it can do whatever the process can, and takes it down when it crashes. Whatever a
//! plugin returns is checked before it is used.
//!
//! # Threads
//!
//! An instance belongs to the thread that opened it, which plays the main thread and, within [`Instance::process`], the audio
//! thread.

#![cfg_attr(not(test), warn(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_possible_wrap))]

mod automation;
mod automation_file;
mod backend;
mod bounce;
mod bundle;
mod clap;
mod editor;
mod error;
mod info;
mod instance;
mod mark;
mod menu;
mod parameter;
mod preset;
mod remote_page;
mod setup;
mod vst3;

pub use automation::{AUTOMATION_STEP, Lane, Point};
pub use automation_file::{AutomationFile, MAX_AUTOMATION_BYTES};
pub use bounce::{Bounce, bounce};
pub use bundle::Bundle;
pub use editor::{Editor, EditorSize, EditorStep, Opening};
pub use info::{Format, PluginInfo};
pub use instance::Instance;
pub use mark::{AutomationMark, Colour, Mark, Track};
pub use menu::MenuAction;
pub use parameter::{Edit, EditKind, Parameter};
pub use preset::{Preset, PresetPlace};
pub use promenade_fault::Fault;
pub use remote_page::{KNOBS, RemotePage};
pub use setup::Setup;

/// A number rounded to an integer; out of range it saturates, and 0 stands for what is no number.
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
pub(crate) fn rounded(value: f64) -> i64 {
    value.round() as i64
}
