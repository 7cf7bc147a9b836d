//! Rooms fitted to measured responses.
//!
//! [`Measurements`] are read from files, [`Figures`] say what a response is like, and [`baselines`] what can be foretold
//! without a room.

#![forbid(unsafe_code)]

mod band_signal;
mod bands;
mod baselines;
mod chain;
mod energy_model;
mod error;
mod evaluation;
mod figures;
mod foretell;
mod histories;
mod linear;
mod measurements;
mod octaves;
mod picture;
mod quick;
mod random;
mod report;
mod tail;
mod walls;
mod written;

pub use band_signal::{BandSignal, Impulses};
pub use bands::{BANDS, Bands, PerBand};
pub use baselines::Baseline;
pub use chain::Chain;
pub use energy_model::Octave;
pub use error::FitError;
pub use evaluation::{Row, Split, all_figures, baselines, errors, mean_rows, quick_row};
pub use figures::{Convention, Errors, Figures, OCTAVES_HZ};
pub use foretell::{DRAWS, Early, Foretold};
pub use histories::{Histories, Surface};
pub use measurements::{Clock, Echoes, LoadOptions, Measurement, Measurements, Place, dechorate_echoes};
pub use octaves::FITTED_HZ;
pub use picture::absorption_svg;
pub use quick::{Estimate, OctaveFit, QuickFit, quick_fit};
pub use random::Random;
pub use report::{json, markdown, table};
pub use tail::Noise;
pub use walls::{Path, WALLS, Walls};
pub use written::{MaterialsBeside, box_obj};
