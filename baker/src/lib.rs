//! Promenade's bakery: measured responses, files and folders go in, scenes come out. May allocate, thread and fail with context.

pub mod anchors;
mod bake;
mod calibrate;
pub mod capture;
pub mod checkpoint;
pub mod cloud_scene;
mod convolve;
pub mod cost;
mod direct;
mod error;
pub mod evaluate;
pub mod field;
mod kriging;
mod layout;
mod log_row;
pub mod measure;
mod placement;
pub mod projection;
pub mod random;
pub mod reconstruction;
pub mod responses;
mod room;
pub mod shoebox;
mod spectrum;

pub use promenade_audio::{FileError, atomic, resample, sound, wav};

pub use bake::{BakeFailure, BakeOptions, bake_responses};
pub use capture::{Capture, Clip, Split, Track};
pub use error::BakeError;
pub use layout::LayoutError;
pub use placement::Placement;
pub use responses::{HoldOut, LoadOptions, Response, Responses, Side};
