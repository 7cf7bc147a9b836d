//! SOFA files (AES69-2022): responses as they were recorded, with their places, and the heads that sets of them make.
//!
//! [`Sofa`] reads any set raw: nothing is resampled, normalised or interpolated. [`read_head`] makes a [`promenade_core::Head`]
//! of one, [`read_headphones`] what a pair of headphones needs.

#![forbid(unsafe_code)]

mod delay;
mod directivity;
mod distance;
mod ears;
mod error;
mod file;
mod head;
mod headphones;
mod measured;
mod recorded;
mod spherical;
mod variables;

pub use directivity::{Directions, read_directivity};
pub use distance::farthest;
pub use ears::{Sided, ears_contradict};
pub use error::SofaError;
pub use file::{Sofa, SofaOptions, check_size};
pub use head::read_head;
pub use headphones::read_headphones;
pub use measured::read_measured;
pub use recorded::{About, Recorded};
pub use spherical::{Side, to_cartesian};
