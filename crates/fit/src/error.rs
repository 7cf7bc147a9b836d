//! What can go wrong with a fit.

use promenade_fault::Fault;

/// Why measurements cannot be read or a room cannot be fitted to them.
pub type FitError = Fault;

/// The measurements cannot be what they are said to be.
pub(crate) fn measurement(name: &str, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Fault {
    Fault::argument(format_args!("measurement {name}"), expected, found)
}
