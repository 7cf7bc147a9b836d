//! Random numbers, descent and small linear systems.

mod adam;
mod linear;
mod random;

pub(crate) use adam::Adam;
pub(crate) use linear::solve;
pub use random::Random;
