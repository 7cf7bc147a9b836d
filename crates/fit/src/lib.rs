//! Rooms fitted to measured responses.
//!
//! [`Measurements`] are read from files, [`Figures`] describe a response, and [`baselines`] what can be predicted without a
//! room. [`full_fit`] finds a [`FullFit`], of which [`Prediction`] makes responses at other places.
//!
//! ```no_run
//! use promenade_fit::{FlatRoom, FullOptions, LoadOptions, Measurements, Walls, full_fit};
//!
//! // Responses with the places of source and microphone: SOFA, or a folder with a measurements.json.
//! let set = Measurements::load("hall".as_ref(), &LoadOptions::default())?;
//! // The room as it is known: a box of these lengths, whose walls may be off.
//! let room = FlatRoom::of_box(Walls::of_size([9.7, 5.5, 2.7])?)?;
//! let fit = full_fit(&room, &set, &FullOptions::default(), &mut |share| println!("{:.0} %", 100.0 * share))?;
//! println!("{} surfaces", fit.surfaces.len());
//! # Ok::<(), promenade_fit::FitError>(())
//! ```

#![forbid(unsafe_code)]

mod appearance;
mod bands;
mod early;
mod error;
mod fits;
mod late;
mod measurements;
mod numerics;
mod prediction;
mod report;
mod room;
mod search;

pub use appearance::{Pictures, Raster, View, similarity};
pub use bands::{BANDS, Bands, Estimate, FITTED_HZ, PerBand};
pub use early::Chain;
pub use error::FitError;
pub use fits::{Alike, Found, FullFit, FullOptions, SurfaceFit, VoxelFit, WallFound, full_fit, octave_t20_s};
pub use late::{Histories, Surface};
pub use measurements::{Clock, Errors, Figures, LEAST_RESPONSES, LoadOptions, Measurement, Measurements, Place};
pub use numerics::Random;
pub use prediction::{
    Arrival, Baseline, Prediction, Residual, RoomModel, Row, Split, all_figures, baselines, fit_row, mean_rows,
    prediction_errors,
};
pub use report::{MaterialsBeside, SourceBeside, box_obj, decays_svg, full_mesh, table};
pub use room::{BoxPath, FlatRoom, FlatWall, Form, MOST_PATCHES, Patch, Path, Sequences, Voxels, WALLS, Walls};
pub use search::{Scanned, Searched, search_box};
