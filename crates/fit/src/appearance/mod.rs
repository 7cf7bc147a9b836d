//! What patches of surfaces look like, and what that says of their absorption.

mod pictures;
mod raster;
mod regressor;
mod similarity;

pub use pictures::{Pictures, View};
pub use raster::Raster;
pub(crate) use regressor::{Example, Regressor};
pub use similarity::similarity;
