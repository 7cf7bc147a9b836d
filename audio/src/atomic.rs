//! Files that are there whole or not at all.

use crate::FileError;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// A file in the making beside its destination: renamed onto it by [`Draft::publish`], removed when dropped before.
///
/// Neither a crash of the writer nor an error half way leaves a partial file under the destination's name.
#[derive(Debug)]
pub struct Draft {
    target: PathBuf,
    partial: PathBuf,
    published: bool,
}

impl Draft {
    /// Opens `NAME.PID-N.partial` beside `target`.
    ///
    /// # Errors
    /// A target that exists and is no regular file (a folder, a device), or a folder that cannot be written to.
    pub fn create(target: &Path) -> Result<(Self, File), FileError> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // A rename would replace a device or a link to one, such as the null device.
        if fs::metadata(target).is_ok_and(|m| !m.is_file()) {
            return Err(FileError::content(target, "the name of a file to write", "a folder or a device"));
        }
        let Some(name) = target.file_name() else {
            return Err(FileError::content(target, "the name of a file to write", "a path without a file name"));
        };
        let mut partial_name = name.to_os_string();
        partial_name.push(format!(".{}-{}.partial", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
        let partial = target.with_file_name(partial_name);
        let file = OpenOptions::new().write(true).create_new(true).open(&partial).map_err(FileError::write(target))?;
        Ok((Self { target: target.to_path_buf(), partial, published: false }, file))
    }

    /// Where the file will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Gives the finished file its name, replacing a file that had it.
    ///
    /// # Errors
    /// The rename failed; the partial file is removed.
    pub fn publish(mut self) -> Result<(), FileError> {
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

/// Writes a whole file at once, or leaves what was there.
///
/// # Errors
/// As [`Draft::create`], or the disk is full or read-only.
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let (draft, mut file) = Draft::create(target)?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(FileError::write(target))?;
    drop(file);
    draft.publish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("scene.promenade");
        let (draft, mut file) = Draft::create(&target).unwrap();
        file.write_all(b"half").unwrap();
        assert!(!target.exists());
        drop(draft);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "an abandoned draft leaves nothing");
        write(&target, b"one").unwrap();
        write(&target, b"two").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"two");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn refuses_folders_and_places_that_do_not_exist() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(write(folder.path(), b""), Err(FileError::Content { .. })));
        assert!(matches!(write(&folder.path().join("no/such/file"), b""), Err(FileError::Write { .. })));
    }
}
