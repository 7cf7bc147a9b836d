//! Regular files, read up to a limit; on a command line the standard streams too.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{Error, ErrorKind, IsTerminal, Read, Result, Seek, Write, stdin};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// What has been read, by its real path, in a command-line program.
static INPUTS: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);
/// What has come from standard input, which is opened more than once, as to look at its beginning.
static STANDARD_INPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());
/// Bytes of standard input at most.
const MAX_STANDARD_INPUT: u64 = 1 << 32;
/// Whether standard output holds a file, so that messages go elsewhere.
static OUTPUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Says that this process is a command-line program that makes one file of others: from now on a file that has been read is
/// not written over, and `-` is standard input and output.
pub fn keep_inputs() {
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default();
}

/// Whether a path is that of the standard streams.
#[must_use]
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-" && INPUTS.lock().unwrap_or_else(PoisonError::into_inner).is_some()
}

/// Whether standard output is a file that is written, and no place for messages.
#[must_use]
pub fn output_is_taken() -> bool {
    OUTPUT_IS_TAKEN.load(Ordering::Relaxed)
}

pub(crate) fn take_output() {
    OUTPUT_IS_TAKEN.store(true, Ordering::Relaxed);
}

/// A new file in the system's folder for such, to write and to read.
pub(crate) fn temporary(ending: &str) -> Result<(PathBuf, File)> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    loop {
        let name = format!("promenade.{}-{}{ending}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((path, made?)),
        }
    }
}

/// What standard input holds, as a file without a name.
fn standard_input() -> Result<File> {
    let mut bytes = STANDARD_INPUT.lock().unwrap_or_else(PoisonError::into_inner);
    if bytes.is_empty() {
        let wrong = |kind, found: &str| Error::new(kind, format!("expected a file or a pipe as standard input, found {found}"));
        if stdin().is_terminal() {
            return Err(wrong(ErrorKind::InvalidInput, "a terminal"));
        }
        stdin().lock().take(MAX_STANDARD_INPUT + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > MAX_STANDARD_INPUT {
            return Err(wrong(ErrorKind::FileTooLarge, "more than 4 GiB"));
        }
    }
    let (path, mut file) = temporary(".promenade-partial")?;
    // Where an open file keeps its name, the next program that leaves a draft there removes it.
    let _ = fs::remove_file(path);
    file.write_all(&bytes)?;
    file.rewind()?;
    Ok(file)
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
    if is_standard(path) {
        return Ok(());
    }
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
    if is_standard(path) {
        return standard_input();
    }
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
