//! Random numbers and descent.

mod adam;
mod random;

pub(crate) use adam::Adam;
pub use random::Random;
