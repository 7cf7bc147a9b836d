//! How well a scene sounds and what it costs.

pub mod evaluate;
pub mod listener;
pub mod measure;
