//! Measured responses with their places.
//!
//! [`Measurements::load`] reads a SOFA file, a folder with a `measurements.json`, or the layout of R3VIVAL, which it
//! recognises by the names of its files. Places are in metres, z up. Whatever a microphone is, a fit sees one channel of
//! sound pressure, of AmbiX the first; two ears are refused.
//!
//! [`Figures`] are what is measured of one response.

mod check;
mod figures;
mod folder;
mod load;
mod published;
mod r3vival;
mod recorded;
mod set;
mod sofa;

pub use figures::{Errors, Figures};
pub(crate) use set::distance;
pub use set::{Clock, LEAST_RESPONSES, LoadOptions, Measurement, Measurements, Place};
