//! What can go wrong with a file.

/// Why a file could not be read, written or converted.
pub type FileError = promenade_fault::Fault;
