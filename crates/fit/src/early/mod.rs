//! The beginnings of responses: the chain of loudspeaker and microphone, images as impulses in bands, how far these are from
//! what was observed, and what each number that is sought does to them.

mod band_signal;
mod chain;
mod iterate;
mod loss;
mod model;
mod sensitivity;
mod source_nodes;
mod unknowns;

pub(crate) use band_signal::{BandSignal, Impulses};
pub use chain::Chain;
pub(crate) use iterate::{Diffuse, Geometry, Iterate, Stage};
pub(crate) use loss::Compared;
pub(crate) use model::EarlyModel;
pub(crate) use source_nodes::{NODES, Nodes};
pub(crate) use unknowns::{Prior, Unknowns, WALL_SD_M, of_table};
