//! Promenade's bakery: measured responses, files and folders go in, scenes come out. May allocate, thread and fail with
//! context.

mod bake;
mod error;
mod judge;
mod signal;
mod sources;

pub use promenade_audio::{FileError, atomic, file, resample, sound, wav};
pub use promenade_judge::{cost, trade};
pub use promenade_sofa::{SofaError, read_head, read_measured};

pub use bake::{BakeOptions, CONTENT, bake_responses, cloud_scene, field, geometry};
pub use error::BakeError;
pub use judge::{evaluate, listener, measure, streaming};
pub use sources::Split;
pub use sources::capture::{Capture, Clip, Track};
pub use sources::responses::{HoldOut, Levels, LoadOptions, Response, Responses, Side, Walls};
pub use sources::{ambisonic, anchors, capture, checkpoint, reconstruction, responses, simulation};
