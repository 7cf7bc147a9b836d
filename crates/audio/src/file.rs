//! Regular files, read up to a limit.

use std::fs::{self, File};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Whether a path names a regular file, or a link to one.
///
/// # Errors
/// Nothing is there; a folder, a pipe, a socket or a device.
pub fn check(path: &Path) -> Result<()> {
    let about = fs::metadata(path)?;
    if about.is_file() {
        return Ok(());
    }
    let found = if about.is_dir() { "a folder" } else { "a pipe, a socket or a device" };
    Err(Error::new(ErrorKind::InvalidInput, format!("expected a regular file, found {found}")))
}

/// Opens a regular file for reading.
///
/// # Errors
/// Nothing is there; a folder, a pipe, a socket or a device; a file that may not be read.
pub fn open(path: &Path) -> Result<File> {
    // Opening a pipe would wait for its writer, and a device may have no end.
    check(path)?;
    File::open(path)
}

/// The whole content of a regular file of at most `most` bytes.
///
/// # Errors
/// Those of [`open`], or a longer file; it is not read to its end.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = open(path)?;
    let size = file.metadata()?.len();
    let too_long = |found: String| Error::new(ErrorKind::FileTooLarge, format!("expected at most {most} bytes, found {found}"));
    if size > most {
        return Err(too_long(size.to_string()));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    // Files of the system's own have a size of 0, and others may grow.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_long("more".to_owned())) } else { Ok(bytes) }
}
