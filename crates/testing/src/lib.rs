//! What the tests of all crates share: signals and measures, scenes made of numbers, anchor clouds, golden vectors, what no
//! host should send, command lines of the documents, and the data beside the checkout.

pub mod clouds;
pub mod documents;
pub mod fuzz;
pub mod golden;
pub mod heads;
pub mod hostile;
pub mod scenes;
mod seeds;
pub mod signal;

pub use fastrand::Rng;
pub use seeds::for_seeds;
pub use signal::{Noise, noise, noise_at};

use std::path::{Path, PathBuf};

/// A file or folder of `../shared`, the data beside the checkout. Tests that need it are ignored by default, in a module
/// `needs_shared`; `cargo xtask test` runs them where there is such a folder.
///
/// # Panics
/// It is not there.
#[must_use]
pub fn shared(path: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(path);
    assert!(path.exists(), "{} does not exist", path.display());
    path
}
