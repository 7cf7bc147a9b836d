//! What can be wrong with a file of a path.

use promenade_fault::Fault;

/// Why a file holds no camera path.
pub type PathFileError = Fault;

/// An option is out of range, or is not for this kind of file; `option` is a field of [`crate::ImportOptions`].
pub(crate) fn option(option: &str, expected: impl std::fmt::Display, found: impl std::fmt::Display) -> Fault {
    Fault::argument(format_args!("option {option}"), expected, found)
}
