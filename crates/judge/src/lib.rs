//! What a scene's settings cost and how far they are off, by playing the engine offline: for the baker's reports and for the
//! editor's.
//!
//! None of this is real-time safe. Whatever takes long is given a closure that says whether its result is still wanted.

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
