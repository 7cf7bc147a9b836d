//! The user's own head as a project keeps it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use promenade_core::Head;
use promenade_core::head::MAX_HEAD_BYTES;
use promenade_fault::Fault;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A head by its content: the project plays it wherever it is opened. Empty, the scene's own head plays.
///
/// A state has the head's bytes as base64, at most 350 kB.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct SavedHead {
    content: Option<Arc<str>>,
}

/// Characters of a head, at most.
fn longest() -> usize {
    MAX_HEAD_BYTES.div_ceil(3) * 4
}

impl SavedHead {
    /// Of a head.
    pub fn of(head: &Head) -> Self {
        Self { content: Some(STANDARD.encode(head.to_bytes()).into()) }
    }

    /// The head, if it is not the scene's own.
    ///
    /// # Errors
    /// What is kept is too long, damaged, or of a later version.
    pub fn head(&self) -> Result<Option<Head>, Fault> {
        let Some(content) = &self.content else { return Ok(None) };
        if content.len() > longest() {
            let found = format!("{} characters", content.len());
            return Err(Fault::argument("the project's head", format_args!("at most {}", longest()), found));
        }
        let bytes = STANDARD.decode(&**content).map_err(|error| Fault::because("the project's head is damaged", error))?;
        Head::from_bytes(&bytes).map(Some).map_err(|error| Fault::because("the project's head cannot be read", error))
    }

    /// Whether it is another head than the scene's own.
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
        let reason = |text: &str| promenade_fault::with_causes(&SavedHead::from(text.to_owned()).head().unwrap_err());
        assert!(reason("????").contains("the project's head is damaged"));
        assert!(reason("AAAA").contains("the project's head cannot be read: head: expected the bytes of one"));
        assert!(reason(&"A".repeat(1 << 20)).contains("expected at most"));
    }
}
