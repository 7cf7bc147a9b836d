//! What is wrong with a file or a value, said so that the user can mend it: the error of everything that callers report and do
//! not tell apart.
//!
//! ```
//! use promenade_fault::Fault;
//! use std::path::Path;
//!
//! /// Metres of a length that somebody has typed.
//! fn length(text: &str) -> Result<f64, Fault> {
//!     let number: f64 = text.parse().map_err(|error| Fault::because(format!("{text:?} is no length"), error))?;
//!     if number > 0.0 { Ok(number) } else { Err(Fault::argument("length", "more than 0 m", number)) }
//! }
//!
//! assert_eq!(length("-2").unwrap_err().to_string(), "length: expected more than 0 m, found -2");
//! let missing = Fault::content(Path::new("room.json"), "a field \"size\"", "none");
//! assert_eq!(missing.to_string(), "room.json: expected a field \"size\", found none");
//! # assert!(length("2").is_ok() && length("two").is_err());
//! ```

use std::error::Error;
use std::fmt;
use std::path::Path;

/// Any error as a cause.
type Source = Box<dyn Error + Send + Sync>;

/// What is wrong, and where. Causes are chained, not repeated in the message.
#[derive(Debug)]
pub struct Fault {
    /// The message; empty where it is the cause's.
    text: String,
    source: Option<Source>,
}

impl Fault {
    /// A message without a cause.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), source: None }
    }

    /// A message about a cause.
    pub fn because(text: impl Into<String>, source: impl Into<Source>) -> Self {
        Self { text: text.into(), source: Some(source.into()) }
    }

    /// An error of a type of its own, with its own message.
    pub fn of(source: impl Into<Source>) -> Self {
        Self::because("", source)
    }

    /// Something is not what is needed.
    pub fn unexpected(expected: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self::new(format!("expected {expected}, found {found}"))
    }

    /// A value that somebody has given, not in a file, is not what it may be.
    pub fn argument(what: impl fmt::Display, expected: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self::new(format!("{what}: expected {expected}, found {found}"))
    }

    /// The content of a file or folder is not what is needed.
    pub fn content(path: &(impl AsRef<Path> + ?Sized), expected: impl fmt::Display, found: impl fmt::Display) -> Self {
        Self::argument(path.as_ref().display(), expected, found)
    }

    /// A line, entry or variable of a file is not what is needed.
    pub fn entry(
        path: &(impl AsRef<Path> + ?Sized),
        entry: impl fmt::Display,
        expected: impl fmt::Display,
        found: impl fmt::Display,
    ) -> Self {
        Self::argument(format_args!("{}: {entry}", path.as_ref().display()), expected, found)
    }

    /// For `map_err`: a file or folder cannot be opened or read.
    pub fn read<E: Into<Source>>(path: &(impl AsRef<Path> + ?Sized)) -> impl Fn(E) -> Self {
        Self::at(path, "cannot be read")
    }

    /// For `map_err`: a file cannot be written.
    pub fn write<E: Into<Source>>(path: &(impl AsRef<Path> + ?Sized)) -> impl Fn(E) -> Self {
        Self::at(path, "cannot be written")
    }

    /// For `map_err`: a JSON file has another form.
    pub fn json<E: Into<Source>>(path: &(impl AsRef<Path> + ?Sized)) -> impl Fn(E) -> Self {
        Self::at(path, "not the JSON that is expected here")
    }

    /// For `map_err`: something is wrong with a file that its reader or the system has words for.
    pub fn at<E: Into<Source>>(path: &(impl AsRef<Path> + ?Sized), what: impl fmt::Display) -> impl Fn(E) -> Self {
        let text = format!("{}: {what}", path.as_ref().display());
        move |source| Self::because(text.clone(), source)
    }

    /// A file is damaged or of an unknown kind; `what` names what it should be.
    pub fn unreadable(path: &(impl AsRef<Path> + ?Sized), what: &str, source: impl Into<Source>) -> Self {
        Self::because(format!("{}: no readable {what}", path.as_ref().display()), source)
    }
}

/// An error's message, followed by those of its causes that it does not repeat, in one line.
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

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.source {
            Some(source) if self.text.is_empty() => source.fmt(f),
            _ => f.write_str(&self.text),
        }
    }
}

impl Error for Fault {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        let source = self.source.as_deref()?;
        if self.text.is_empty() { source.source() } else { Some(source) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io;

    fn chain(fault: &Fault) -> Vec<String> {
        let mut chain = vec![fault.to_string()];
        let mut cause = fault.source();
        while let Some(error) = cause {
            chain.push(error.to_string());
            cause = error.source();
        }
        chain
    }

    #[test]
    fn messages_say_where_what_was_expected_and_what_was_found() {
        assert_eq!(Fault::argument("rate", "1 to 9", 10).to_string(), "rate: expected 1 to 9, found 10");
        let entry = Fault::entry("a/b.csv", "line 3", "a number", "\"x\"");
        assert_eq!(entry.to_string(), "a/b.csv: line 3: expected a number, found \"x\"");
        assert_eq!(Fault::content("a", "some", "none").to_string(), "a: expected some, found none");
    }

    #[test]
    fn causes_are_chained_and_not_repeated() {
        let gone = || io::Error::other("gone");
        assert_eq!(chain(&Fault::read("a")(gone())), ["a: cannot be read", "gone"]);
        assert_eq!(with_causes(&Fault::because("all of it", Fault::read("a")(gone()))), "all of it: a: cannot be read: gone");
        assert_eq!(chain(&Fault::unreadable("a", "WAV file", gone())), ["a: no readable WAV file", "gone"]);
        assert_eq!(chain(&Fault::of(Fault::write("a")(gone()))), ["a: cannot be written", "gone"], "its own message");
    }
}
