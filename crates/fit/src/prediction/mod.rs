//! Responses of a fitted room at any place, what its surfaces do not explain of them, and how far predictions are off.

mod baselines;
mod evaluation;
mod predict;
mod residual;
mod residual_estimate;
mod room_model;

pub use baselines::Baseline;
pub use evaluation::{Row, Split, all_figures, baselines, fit_row, mean_rows, prediction_errors};
pub use predict::Prediction;
pub use residual::Residual;
pub use room_model::{Arrival, RoomModel};
