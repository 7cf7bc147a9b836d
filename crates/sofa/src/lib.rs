//! SOFA files (AES69-2022): responses as they were recorded, with their places, and the heads that sets of them make.
//!
//! [`Sofa`] reads any set raw: nothing is resampled, normalised or interpolated. [`read_head`] makes a [`promenade_core::Head`]
//! of one, [`read_headphones`] what a pair of headphones needs.
//!
//! ```no_run
//! use promenade_sofa::{Sofa, SofaOptions, read_head};
//! use std::path::Path;
//!
//! // Every response as it was recorded, with its place.
//! let file = Path::new("MIT_KEMAR_normal_pinna.sofa");
//! let mut count = 0;
//! let (about, exchanged) = Sofa::open(file)?.of_ears(SofaOptions::default(), |_| count += 1)?;
//! println!("{}: {count} responses, ears exchanged: {exchanged}", about.title);
//!
//! // What a scene is heard with instead of its own head.
//! let head = read_head(file)?;
//! let scene = promenade_core::Scene::from_bytes(&std::fs::read("room.promenade")?)?.with_head(&head)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
