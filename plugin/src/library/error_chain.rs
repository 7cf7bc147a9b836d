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
