//! Permits to listen to networks: a project may ask for it, and the user of this machine decides.
//!
//! A permit is a random word that is saved with the project. This machine keeps the hashes of those that its user has given, so
//! that a project from elsewhere has none, and knowing the machine's file does not make one.

use crate::library::file::read_limited;
use std::collections::hash_map::RandomState;
use std::fs::{self, OpenOptions};
use std::hash::BuildHasher;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A larger file is refused, bytes: room for a million permits.
const LARGEST_FILE: u64 = 65 << 20;

/// The permits that the user of a machine has given.
#[derive(Clone, Debug)]
pub(super) struct Permits(Option<PathBuf>);

impl Permits {
    /// Those of this machine.
    pub(super) fn of_this_machine() -> Self {
        Self(dirs::data_local_dir().map(|folder| folder.join("promenade").join("network-permits")))
    }

    /// Those in a file, which need not exist.
    #[cfg(test)]
    pub(super) fn in_file(file: PathBuf) -> Self {
        Self(Some(file))
    }

    /// Whether a permit was given on this machine. What cannot be read holds none.
    pub(super) fn include(&self, permit: &str) -> bool {
        let known = self.0.as_ref().and_then(|file| read_limited(file, LARGEST_FILE).ok()).unwrap_or_default();
        let wanted = line_of(permit);
        !permit.is_empty() && String::from_utf8_lossy(&known).lines().any(|line| line == wanted)
    }

    /// Gives a new one.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn give(&self) -> io::Result<String> {
        let file = self
            .0
            .as_ref()
            .ok_or_else(|| io::Error::new(ErrorKind::NotFound, "this system names no folder for a user's data"))?;
        let permit = word();
        fs::create_dir_all(file.parent().unwrap_or(Path::new("")))?;
        writeln!(OpenOptions::new().create(true).append(true).open(file)?, "{}", line_of(&permit))?;
        Ok(permit)
    }
}

fn line_of(permit: &str) -> String {
    blake3::hash(permit.as_bytes()).to_hex().to_string()
}

/// 128 bits of the system's random numbers, in hexadecimal.
fn word() -> String {
    // Each state is seeded by the system, or differs from one that was.
    (0..2).map(|part: u64| format!("{:016x}", RandomState::new().hash_one(part))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_was_given_here_is_a_permit() {
        let folder = tempfile::tempdir().unwrap();
        let here = Permits::in_file(folder.path().join("new/permits"));
        assert!(!here.include("") && !here.include("x"));
        let (first, second) = (here.give().unwrap(), here.give().unwrap());
        assert_ne!(first, second);
        assert!(here.include(&first) && here.include(&second));
        let there = Permits::in_file(folder.path().join("there"));
        assert!(!there.include(&first));
        let kept = fs::read_to_string(folder.path().join("new/permits")).unwrap();
        assert_eq!(kept.lines().count(), 2);
        assert!(
            !kept.contains(&first) && !here.include(kept.lines().next().unwrap()),
            "the file does not hold permits themselves"
        );
        assert!(Permits(None).give().is_err());
    }
}
