//! Rooms fitted to measured responses.
//!
//! [`Measurements`] are read from files, [`Figures`] describe a response, and [`baselines`] what can be foretold
//! without a room.

#![forbid(unsafe_code)]

mod adam;
mod alike;
mod band_signal;
mod bands;
mod baselines;
mod box_search;
mod chain;
mod decays;
mod early_model;
mod echo_walls;
mod energy_model;
mod error;
mod estimate;
mod evaluation;
mod figures;
mod flat_room;
mod foretell;
mod full_fit;
mod full_report;
mod guess;
mod histories;
mod late_tie;
mod linear;
mod looks;
mod loss;
mod measurements;
mod octaves;
#[cfg(feature = "onnx")]
mod onnx;
mod picture;
mod plan;
mod quick;
mod random;
mod report;
mod residual;
mod saved;
mod similarity;
mod source_nodes;
mod tail;
mod unknowns;
mod wall_scan;
mod walls;
mod written;

pub use alike::{Alike, octave_t20_s};
pub use band_signal::{BandSignal, Impulses};
pub use bands::{BANDS, Bands, PerBand};
pub use baselines::Baseline;
pub use box_search::{Searched, search_box};
pub use chain::Chain;
pub use decays::decays_svg;
pub use echo_walls::{EchoBox, EchoWall, echo_box};
pub use energy_model::Octave;
pub use error::FitError;
pub use estimate::Estimate;
pub use evaluation::{Row, Split, all_figures, baselines, errors, fit_row, foretold_errors, full_row, mean_rows, quick_row};
pub use figures::{Convention, Errors, Figures, OCTAVES_HZ};
pub use flat_room::voxels::{MOST_PATCHES, Patch, Voxels};
pub use flat_room::{FlatRoom, FlatWall, Form, Sequences, Way};
pub use foretell::{DRAWS, Early, Foretold};
pub use full_fit::voxel_fit::VoxelFit;
pub use full_fit::{Found, FullFit, FullOptions, SurfaceFit, WallFound, full_fit};
pub use full_report::{full_json, full_markdown};
pub use histories::{Histories, Surface};
pub use looks::{Pictures, Raster, View};
pub use measurements::{Clock, Echoes, LEAST_RESPONSES, LoadOptions, Measurement, Measurements, Place, dechorate_echoes};
pub use octaves::FITTED_HZ;
#[cfg(feature = "onnx")]
pub use onnx::Network;
pub use picture::{Curve, absorption_svg};
pub use plan::plan_svg;
pub use quick::{OctaveFit, QuickFit, quick_fit};
pub use random::Random;
pub use report::{json, markdown, table};
pub use residual::Residual;
pub use saved::Saved;
pub use similarity::similarity;
pub use tail::Noise;
pub use wall_scan::Scanned;
pub use walls::{Path, WALLS, Walls};
pub use written::{MaterialsBeside, box_obj, full_mesh, full_obj, room_obj};
