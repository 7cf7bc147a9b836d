//! Where acoustics come from: measured responses, recordings, reconstructions, published checkpoints, simulated rooms.

pub mod ambisonic;
pub mod anchors;
pub mod capture;
pub mod checkpoint;
mod file;
pub mod reconstruction;
pub mod responses;
pub mod simulation;
mod split;

pub use split::Split;
