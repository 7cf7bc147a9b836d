//! Regular files, read up to a limit.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What has been read, by its real path, once that is to be kept.
static INPUTS: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

/// From now on a file that has been read in this process is not written over; for programs that make one file of others.
pub fn keep_inputs() {
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
}

/// Whether a path leads to a file that was read and is to be kept.
pub(crate) fn is_input(path: &Path) -> bool {
    let inputs = INPUTS.lock().unwrap_or_else(PoisonError::into_inner);
    inputs.as_ref().is_some_and(|inputs| path.canonicalize().is_ok_and(|path| inputs.contains(&path)))
}

/// Whether a path names a regular file, or a link to one.
///
/// # Errors
/// Nothing is there; a folder, a pipe, a socket or a device.
pub fn check(path: &Path) -> Result<()> {
    let about = fs::metadata(path)?;
    if about.is_file() {
        if let Some(inputs) = &mut *INPUTS.lock().unwrap_or_else(PoisonError::into_inner) {
            inputs.insert(path.canonicalize()?);
        }
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
