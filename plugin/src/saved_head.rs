//! The user's own head as a project keeps it, and how one is asked for.

use crate::lock::lock;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use promenade_core::head::MAX_HEAD_BYTES;
use promenade_core::{Head, HeadError};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use thiserror::Error;

/// A head by its content: the project plays it wherever it is opened. Empty, the scene's own head plays.
///
/// A state has the head's bytes as base64, at most 350 kB.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct SavedHead {
    content: Option<Arc<str>>,
}

/// Why the project's head cannot be played.
#[derive(Debug, Error)]
pub enum SavedHeadError {
    /// Longer than any head.
    #[error("the project's head has {0} characters, expected at most {most}", most = longest())]
    TooLong(usize),
    /// Not base64.
    #[error("the project's head is damaged")]
    Base64(#[source] base64::DecodeError),
    /// Not a head.
    #[error("the project's head cannot be read")]
    Head(#[source] HeadError),
}

/// Characters of a head, at most.
fn longest() -> usize {
    MAX_HEAD_BYTES.div_ceil(3) * 4
}

impl SavedHead {
    /// Of a head.
    #[must_use]
    pub fn of(head: &Head) -> Self {
        Self { content: Some(STANDARD.encode(head.to_bytes()).into()) }
    }

    /// The head, if it is not the scene's own.
    ///
    /// # Errors
    /// What is kept is too long, damaged, or of a later version.
    pub fn head(&self) -> Result<Option<Head>, SavedHeadError> {
        let Some(content) = &self.content else { return Ok(None) };
        if content.len() > longest() {
            return Err(SavedHeadError::TooLong(content.len()));
        }
        let bytes = STANDARD.decode(&**content).map_err(SavedHeadError::Base64)?;
        Head::from_bytes(&bytes).map(Some).map_err(SavedHeadError::Head)
    }

    /// Whether it is another head than the scene's own.
    #[must_use]
    pub fn is_some(&self) -> bool {
        self.content.is_some()
    }
}

impl From<String> for SavedHead {
    fn from(content: String) -> Self {
        Self { content: (!content.is_empty()).then(|| content.into()) }
    }
}

impl From<SavedHead> for String {
    fn from(saved: SavedHead) -> Self {
        saved.content.map_or_else(Self::new, |content| content.as_ref().to_owned())
    }
}

/// A head that is asked for by the name of its file, from the editor or over Open Sound Control. The loader reads it.
#[derive(Debug, Default)]
pub struct HeadWish {
    newest: Mutex<Option<String>>,
    /// What the loader has taken last.
    taken: Mutex<String>,
    asked: AtomicU32,
    answered: AtomicU32,
}

impl HeadWish {
    /// Asks for the head in a SOFA file, or with an empty name for the scene's own.
    pub fn ask(&self, file: &str) {
        *lock(&self.newest) = Some(file.trim().to_owned());
        self.asked.fetch_add(1, Ordering::AcqRel);
    }

    /// How often a head has been asked for.
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
    use promenade_testing::heads::sphere;

    #[test]
    fn a_head_survives_a_state_and_damage_is_named() {
        let head = sphere(0.09);
        let saved = SavedHead::of(&head);
        let json = serde_json::to_string(&saved).unwrap();
        assert!(json.len() < longest(), "{} characters", json.len());
        let again: SavedHead = serde_json::from_str(&json).unwrap();
        assert_eq!(again, saved);
        assert_eq!(again.head().unwrap().unwrap(), head);
        let none: SavedHead = serde_json::from_str("\"\"").unwrap();
        assert!(!none.is_some() && none.head().unwrap().is_none());
        let reason = |text: &str| crate::error_chain::with_causes(&SavedHead::from(text.to_owned()).head().unwrap_err());
        assert!(reason("????").contains("the project's head is damaged"));
        assert!(reason("AAAA").contains("the project's head cannot be read: head: expected the bytes of one"));
        assert!(reason(&"A".repeat(1 << 20)).contains("expected at most"));
    }

    #[test]
    fn the_newest_wish_counts() {
        let wish = HeadWish::default();
        wish.ask("one.sofa");
        wish.ask(" two.sofa ");
        assert_eq!((wish.take().as_deref(), wish.take(), wish.asked()), (Some("two.sofa"), None, 2));
        wish.again();
        assert_eq!(wish.take().as_deref(), Some("two.sofa"));
    }
}
