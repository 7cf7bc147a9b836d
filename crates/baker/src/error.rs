//! What can go wrong between files on disk and a scene.

use promenade_fault::Fault;

/// Why something could not be loaded, baked or written.
pub type BakeError = Fault;

/// A response or a rendering cannot be measured; `what` is its name, with what it is.
pub(crate) fn unmeasurable(what: &str, why: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Fault {
    Fault::because(format!("{what} cannot be measured"), why)
}
