//! What a scene's settings cost and how far they are off, by playing the engine offline: for the baker's reports and for the
//! editor's.
//!
//! None of this is real-time safe. Whatever takes long is given a closure that says whether its result is still wanted.
//!
//! ```
//! use promenade_core::Scene;
//! use promenade_judge::cost::real_times;
//! use promenade_judge::response_measures;
//! use std::sync::Arc;
//!
//! let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../presets/scenes/iosr-room-a.promenade");
//! let scene = Arc::new(Scene::from_bytes(&std::fs::read(file)?)?);
//!
//! // Processor seconds per second of sound.
//! let costs = real_times(&[scene], 48_000.0, 512);
//! assert!(costs[0] > Some(0.0));
//! // The figures of a response, here of a click at both ears, which has no decay.
//! let mut click = vec![0.0; 4_800];
//! click[100] = 1.0;
//! let measures = response_measures(&click, &click, 48_000.0)?;
//! assert!(measures.ild_db.abs() < 1e-9 && measures.t20_s.is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod audible;
pub mod cost;
mod error;
mod measures;
mod poses;
pub mod trade;

pub use audible::Heard;
pub use error::JudgeError;
pub use measures::{
    Comparison, MeanErrors, RESPONSE_S, Unmeasurable, mean_level_errors_db, response_levels_db, response_measures, response_s,
};
pub use poses::{Course, Way, noise, poses_within, walk};
