//! Rooms fitted to measured responses.
//!
//! [`Measurements`] are read from files, [`Figures`] say what a response is like, and [`baselines`] what can be foretold
//! without a room.

#![forbid(unsafe_code)]

mod baselines;
mod error;
mod evaluation;
mod figures;
mod measurements;
mod random;

pub use baselines::Baseline;
pub use error::FitError;
pub use evaluation::{Row, Split, all_figures, baselines, mean_rows};
pub use figures::{Convention, Errors, Figures, OCTAVES_HZ};
pub use measurements::{Clock, Echoes, LoadOptions, Measurement, Measurements, Place, dechorate_echoes};
pub use random::Random;
