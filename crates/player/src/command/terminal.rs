//! Lines and bars on standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{IsTerminal, stderr};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

/// Characters of a bar.
const WIDTH: u32 = 40;

/// Prints one line, whatever its parts contain.
#[expect(clippy::print_stderr, reason = "this is the place for it")]
pub fn line(text: impl Display) {
    eprintln!("{}", escaped(&one_line(&text.to_string())));
}

/// Prints a note.
pub fn note(note: impl Display) {
    line(format_args!("note: {note}"));
}

/// Prints notes.
pub fn notes(notes: &[String]) {
    notes.iter().for_each(note);
}

/// An error and what caused it, from the general to the particular.
#[must_use]
pub fn chain(error: &(dyn Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |&error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

/// Reports a sound that has been written: its length, and how fast it was made.
pub fn done(output: &Path, frames: u64, rate_hz: f64, began: Instant) {
    let (sound, took) = (frames as f64 / rate_hz, began.elapsed().as_secs_f64());
    line(format_args!(
        "{}: {sound:.2} s of sound in {took:.2} s, {:.0} times real time",
        output.display(),
        sound / took.max(1e-9)
    ));
}

/// Text as it may reach a terminal: control characters but line ends, with which the text of a file could move the cursor or
/// change colours and titles, are written as JSON writes them, so that JSON stays JSON.
#[must_use]
pub fn escaped(text: &str) -> String {
    let written = |c: char| if c.is_control() && c != '\n' { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    text.chars().map(written).collect()
}

/// Text without line ends.
#[must_use]
pub fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// How much of some work is done, on a terminal: a bar, its share and the time that is left. It is cleared when it is dropped.
pub struct Bar {
    whole: f64,
    began: Instant,
    /// Percent that are shown; beyond 100 where there is no terminal.
    shown: AtomicU32,
}

impl Bar {
    /// Of work that is done at `whole`, such as seconds of sound.
    #[must_use]
    pub fn new(whole: f64) -> Self {
        let shown = if stderr().is_terminal() { 0 } else { u32::MAX };
        Self { whole, began: Instant::now(), shown: AtomicU32::new(shown) }
    }

    /// Shows that the work has come so far.
    #[expect(clippy::print_stderr, reason = "this is the place for it")]
    pub fn at(&self, done: f64) {
        let share = (done / self.whole).clamp(0.0, 1.0);
        let percent = (100.0 * share) as u32;
        if percent > self.shown.fetch_max(percent, Ordering::Relaxed) {
            let left = self.began.elapsed().as_secs_f64() * (1.0 - share) / share;
            let (full, left) = (WIDTH * percent / 100, left.round() as u64);
            let bar = "█".repeat(full as usize) + &"░".repeat((WIDTH - full) as usize);
            eprint!("\r{bar} {percent:>3} %, {}:{:02} left\u{1b}[K", left / 60, left % 60);
        }
    }
}

impl Drop for Bar {
    #[expect(clippy::print_stderr, reason = "this is the place for it")]
    fn drop(&mut self) {
        if *self.shown.get_mut() <= 100 {
            eprint!("\r\u{1b}[K");
        }
    }
}
