//! The baker: measured responses, recordings, checkpoints and meshes go in, scenes come out. May allocate, thread and fail with
//! context.
//!
//! ```no_run
//! use promenade_baker::{BakeOptions, LoadOptions, Responses, bake_responses};
//! use std::path::Path;
//!
//! // A folder with a responses.json, a manifest, or a SOFA file. Every second response is held out, to judge the scene by.
//! let responses = Responses::load(Path::new("my-room"), &LoadOptions::default())?;
//! let scene = bake_responses(&responses, |_, index| index % 2 == 1, &BakeOptions::default())?;
//! std::fs::write("my-room.promenade", scene.to_bytes()?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
pub use judge::{evaluate, listener, measure};
pub use sources::Split;
pub use sources::capture::{Capture, Clip, Track};
pub use sources::responses::{HoldOut, Levels, LoadOptions, Response, Responses, Side, Walls};
pub use sources::{ambisonic, anchors, capture, checkpoint, reconstruction, responses, simulation};
