//! How much is read of a file.

/// Bytes that a file may have that is read whole: COLMAP's list every point that every image sees.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
