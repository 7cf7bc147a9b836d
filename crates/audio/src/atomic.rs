//! Files that are there whole or not at all.

use crate::{FileError, file};
use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write, stdout};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// Ending of a file in the making.
const ENDING: &str = ".promenade-partial";
/// Symbolic links that lead from one to the next, at most; as many as Linux follows.
const MAX_LINKS: usize = 40;

/// A file in the making beside its destination: renamed onto it by [`Draft::publish`], removed when dropped before.
///
/// Neither a crash of the writer nor an error half way leaves a partial file under the destination's name. What a killed
/// process leaves behind is removed when another one makes a draft in the same folder: a draft is locked as long as its process
/// lives. What goes to standard output ([`file::is_standard`]) is whole before its first byte.
#[derive(Debug)]
pub struct Draft {
    target: PathBuf,
    partial: PathBuf,
    /// Keeps the lock until the draft has its name or is gone.
    _lock: File,
    published: bool,
}

impl Draft {
    /// Opens `NAME.PID-N.promenade-partial` beside `target`, or beside what it links to.
    ///
    /// # Errors
    /// A target that exists and is no regular file (a folder, a device), or is kept as an input (see [`file::keep_inputs`]),
    /// links in a circle, or a folder that cannot be written to.
    pub fn create(target: &Path) -> Result<(Self, File), FileError> {
        if file::is_input(target) {
            return Err(FileError::content(target, "the name of a file that is not read as well", "one that is"));
        }
        Self::replacing(target)
    }

    /// That of a file which may have been read, as a state or a folder that goes on.
    pub(crate) fn replacing(target: &Path) -> Result<(Self, File), FileError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        if file::is_standard(target) {
            file::take_output();
            let made = file::temporary(ENDING).and_then(|(partial, file)| Ok((partial, file.try_clone()?, file)));
            let (partial, lock, file) = made.map_err(FileError::write(target))?;
            let _ = lock.lock();
            return Ok((Self { target: target.to_path_buf(), partial, _lock: lock, published: false }, file));
        }
        let target = &linked(target)?;
        // A rename would replace a device, such as the null device.
        if fs::metadata(target).is_ok_and(|m| !m.is_file()) {
            return Err(FileError::content(target, "the name of a file to write", "a folder or a device"));
        }
        let Some(name) = target.file_name() else {
            return Err(FileError::content(target, "the name of a file to write", "a path without a file name"));
        };
        remove_leftovers_once(target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")));
        loop {
            let mut partial_name = name.to_os_string();
            partial_name.push(format!(".{}-{}{ENDING}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
            let partial = target.with_file_name(partial_name);
            let file = OpenOptions::new().write(true).create_new(true).open(&partial).map_err(FileError::write(target))?;
            // Where the file system has no locks, nothing is removed either.
            let _ = file.lock();
            // Another process may have removed it before it was locked.
            if partial.exists() {
                let lock = file.try_clone().map_err(FileError::write(target))?;
                return Ok((Self { target: target.clone(), partial, _lock: lock, published: false }, file));
            }
        }
    }

    /// Where the file will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Gives the finished file its name, replacing a file that had it.
    ///
    /// # Errors
    /// The rename failed, or standard output cannot be written; the partial file is removed.
    pub fn publish(mut self) -> Result<(), FileError> {
        if file::is_standard(&self.target) {
            let done = File::open(&self.partial).and_then(|mut file| std::io::copy(&mut file, &mut stdout().lock()));
            // A reader that has had enough is no failure.
            let done = done.map(drop).or_else(|e| if e.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(e) });
            return done.and_then(|()| stdout().flush()).map_err(FileError::write(&self.target));
        }
        fs::rename(&self.partial, &self.target).map_err(FileError::write(&self.target))?;
        self.published = true;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.published {
            // Nothing is left to do where even this fails.
            let _ = fs::remove_file(&self.partial);
        }
    }
}

/// Where a file is written that may be a symbolic link: the link stays. What it leads to need not exist.
fn linked(target: &Path) -> Result<PathBuf, FileError> {
    let mut path = target.to_path_buf();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            Ok(to) => path = path.parent().unwrap_or(Path::new("")).join(to),
            Err(_) => return Ok(path),
        }
    }
    Err(FileError::content(target, "the name of a file to write", "symbolic links in a circle"))
}

/// Removes the drafts of processes that have ended from a folder; once for each process, since many files may go into one
/// folder.
fn remove_leftovers_once(folder: &Path) {
    static DONE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    if DONE.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_path_buf()) {
        remove_leftovers(folder);
    }
}

fn remove_leftovers(folder: &Path) {
    // What cannot be listed, opened or removed stays.
    for path in fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()) {
        let is_draft = path.file_name().and_then(|n| n.to_str()).is_some_and(|name| name.ends_with(ENDING));
        if is_draft
            && let Ok(file) = file::open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Writes a whole file at once, or leaves what was there.
///
/// # Errors
/// Those of [`Draft::create`], or the disk is full or read-only.
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    fill(Draft::create(target)?, target, bytes)
}

/// Writes a whole file at once over one that may have been read, as a state that goes on.
///
/// # Errors
/// Those of [`write`], but for inputs.
pub fn replace(target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    fill(Draft::replacing(target)?, target, bytes)
}

fn fill((draft, mut file): (Draft, File), target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(FileError::write(target))?;
    drop(file);
    draft.publish()
}
