//! Files that are asked for: of heads and of headphones.

use crate::worker::lock::lock;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// A file that is asked for by its name, from the editor or over Open Sound Control. The loader reads it.
#[derive(Debug, Default)]
pub struct FileWish {
    newest: Mutex<Option<String>>,
    /// What the loader has taken last.
    taken: Mutex<String>,
    asked: AtomicU32,
    answered: AtomicU32,
}

impl FileWish {
    /// Asks for a file, or with an empty name for none.
    pub fn ask(&self, file: &str) {
        *lock(&self.newest) = Some(file.trim().to_owned());
        self.asked.fetch_add(1, Ordering::AcqRel);
    }

    /// How often a file has been asked for.
    ///
    /// # Real-time
    /// Any thread; no allocation, lock or I/O.
    pub fn asked(&self) -> u32 {
        self.asked.load(Ordering::Acquire)
    }

    /// How often the loader has answered: the project has changed each time.
    pub fn answered(&self) -> u32 {
        self.answered.load(Ordering::Acquire)
    }

    /// What has been asked for since the last time.
    pub(crate) fn take(&self) -> Option<String> {
        let newest = lock(&self.newest).take()?;
        lock(&self.taken).clone_from(&newest);
        Some(newest)
    }

    /// Asks once more for the file that was asked for last, if there was one.
    pub(crate) fn again(&self) {
        let taken = lock(&self.taken).clone();
        if !taken.is_empty() {
            lock(&self.newest).get_or_insert(taken);
        }
    }

    /// Notes that the loader has answered.
    pub(crate) fn answer(&self) {
        self.answered.fetch_add(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_wish_counts() {
        let wish = FileWish::default();
        wish.ask("one.sofa");
        wish.ask(" two.sofa ");
        assert_eq!((wish.take().as_deref(), wish.take(), wish.asked()), (Some("two.sofa"), None, 2));
        wish.again();
        assert_eq!(wish.take().as_deref(), Some("two.sofa"));
    }
}
