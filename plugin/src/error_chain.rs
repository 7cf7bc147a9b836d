//! An error and its causes in one line.

use std::error::Error;

/// The error's message, followed by those of its causes that it does not repeat.
#[must_use]
pub fn with_causes(error: &dyn Error) -> String {
    let mut words = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let message = error.to_string();
        if !words.contains(&message) {
            words = format!("{words}: {message}");
        }
        cause = error.source();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::SavedWalk;

    #[test]
    fn the_cause_is_in_the_message() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("walk.json");
        std::fs::write(&path, r#"[{"t": 0, "position": [1, 2, 3]}]"#).unwrap();
        let words = with_causes(&SavedWalk::from_file(&path).unwrap_err());
        assert!(words.contains("walk.json") && words.contains("ypr"), "{words}");
    }
}
