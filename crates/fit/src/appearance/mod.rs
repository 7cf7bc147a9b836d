//! What patches of surfaces look like, and what that says of their absorption.

#[cfg(feature = "onnx")]
mod onnx;
mod pictures;
mod raster;
mod regressor;
mod similarity;

#[cfg(feature = "onnx")]
pub use onnx::Network;
pub use pictures::{Pictures, View};
pub use raster::Raster;
pub(crate) use regressor::{Example, Regressor};
pub use similarity::similarity;
