//! How well a scene sounds and what it costs.

pub mod cost;
pub mod evaluate;
pub mod measure;
pub(crate) mod response_measures;
pub mod streaming;
pub mod trade;
