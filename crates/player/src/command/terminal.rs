//! Lines and bars on standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{IsTerminal, stderr};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Characters of a bar.
const WIDTH: u32 = 40;
/// How often a bar is drawn, and how often work is told of in a log.
const REDRAWN: Duration = Duration::from_millis(200);
const TOLD: Duration = Duration::from_secs(10);
/// Whether a bar is on the terminal.
static DRAWN: AtomicBool = AtomicBool::new(false);

/// Prints one line, whatever its parts contain.
#[expect(clippy::print_stderr, reason = "this is the place for it")]
pub fn line(text: impl Display) {
    clear();
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

/// How far some work is: on a terminal a bar, elsewhere, as in a log, a line every ten seconds; with the time that is left. The
/// bar is cleared when it is dropped.
pub struct Bar {
    work: Arc<Work>,
    ended: Option<Sender<()>>,
    teller: Option<JoinHandle<()>>,
}

struct Work {
    what: String,
    whole: f64,
    began: Instant,
    /// Bits of the share that is done.
    share: AtomicU64,
}

impl Bar {
    /// Of work, such as `simulating`, that is done at `whole`, such as seconds of sound.
    #[must_use]
    pub fn new(what: impl Into<String>, whole: f64) -> Self {
        let bar = stderr().is_terminal();
        let period = if bar { REDRAWN } else { TOLD };
        Self::telling(what.into(), whole, period, move |work| if bar { draw(work) } else { line(work.text()) })
    }

    /// Tells of the work from a thread of its own, so that it is told of where nothing comes on as well.
    fn telling(what: String, whole: f64, period: Duration, tell: impl Fn(&Work) + Send + 'static) -> Self {
        let work = Arc::new(Work { what, whole, began: Instant::now(), share: AtomicU64::new(0) });
        let (ended, end) = channel();
        let told = Arc::clone(&work);
        let telling = move || {
            while end.recv_timeout(period) == Err(RecvTimeoutError::Timeout) {
                tell(&told);
            }
        };
        // Without a thread the work is done all the same.
        Self { work, ended: Some(ended), teller: thread::Builder::new().spawn(telling).ok() }
    }

    /// Says that the work has come so far.
    pub fn at(&self, done: f64) {
        // Bits of positive numbers are in their order.
        self.work.share.fetch_max((done / self.work.whole).clamp(0.0, 1.0).to_bits(), Ordering::Relaxed);
    }
}

impl Work {
    fn share(&self) -> f64 {
        f64::from_bits(self.share.load(Ordering::Relaxed))
    }

    /// What is said of it.
    fn text(&self) -> String {
        let (share, past_s) = (self.share(), self.began.elapsed().as_secs_f64());
        if share > 0.0 {
            let left = minutes(past_s * (1.0 - share) / share);
            format!("{}: {:.0} %, {left} left", self.what, (100.0 * share).floor())
        } else {
            format!("{}: {} so far", self.what, minutes(past_s))
        }
    }
}

/// A time in minutes and seconds.
#[must_use]
pub fn minutes(seconds: f64) -> String {
    let whole = seconds.round().max(0.0);
    format!("{}:{:02}", (whole / 60.0).floor(), whole % 60.0)
}

#[expect(clippy::print_stderr, reason = "this is the place for it")]
fn draw(work: &Work) {
    let full = (work.share() * f64::from(WIDTH)) as usize;
    DRAWN.store(true, Ordering::Relaxed);
    eprint!("\r{}{} {}\u{1b}[K", "█".repeat(full), "░".repeat(WIDTH as usize - full), work.text());
}

/// Takes the bar off the terminal, if there is one.
#[expect(clippy::print_stderr, reason = "this is the place for it")]
fn clear() {
    if DRAWN.swap(false, Ordering::Relaxed) {
        eprint!("\r\u{1b}[K");
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        drop(self.ended.take());
        self.teller.take().map(JoinHandle::join);
        clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_told_of_at_even_times_with_what_is_left_though_nothing_comes_on() {
        let (told, heard) = channel();
        let tell = move |work: &Work| drop(told.send((work.began.elapsed(), work.text())));
        let bar = Bar::telling("simulating".to_owned(), 4.0, Duration::from_millis(50), tell);
        let wait = Duration::from_secs(20);
        assert_eq!(heard.recv_timeout(wait).unwrap().1, "simulating: 0:00 so far");
        bar.at(1.0);
        bar.at(0.5);
        let lines: Vec<_> = (0..3).map(|_| heard.recv_timeout(wait).unwrap()).collect();
        assert!(lines.iter().skip(1).all(|(_, line)| line.starts_with("simulating: 25 %, 0:0")), "{lines:?}");
        assert!(lines.windows(2).all(|pair| pair[1].0 >= pair[0].0 + Duration::from_millis(40)), "{lines:?}");
        drop(bar);
        while heard.try_recv().is_ok() {}
        assert!(heard.recv_timeout(wait).is_err(), "told of after its end");
    }

    #[test]
    fn what_is_left_follows_from_what_is_done() {
        let began = Instant::now().checked_sub(Duration::from_secs(60)).unwrap();
        let work = Work { what: "fitting".to_owned(), whole: 1.0, began, share: AtomicU64::new(0.25_f64.to_bits()) };
        assert_eq!(work.text(), "fitting: 25 %, 3:00 left");
        assert_eq!(minutes(59.6), "1:00");
    }
}
