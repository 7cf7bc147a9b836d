//! Arithmetic of the networks on panels: positions (queries or anchors) side by side in vector lanes.
//!
//! Every step reads and writes `[panel][feature][position]`, so nothing is transposed or repacked between layers, and sums over
//! features or keys run down the rows with all positions at once.

mod attention;
mod exponential;
mod matrix;
mod norm;
mod panel;
mod product;
#[cfg(test)]
mod tests;
mod tile;
mod wave;

pub(crate) use attention::{Attention, Tally, scores_for};
pub(crate) use matrix::{Matrix, dot};
pub(crate) use norm::{Norm, total};
pub(crate) use panel::{PANEL, Panels, Row};
pub(crate) use product::{Activation, PanelProduct, Start};
pub(crate) use tile::{Columns, in_columns};
pub(crate) use wave::Waves;
