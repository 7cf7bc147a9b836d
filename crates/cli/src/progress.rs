//! A bar on standard error, when that is a terminal.

use crate::report;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use std::time::Instant;

/// A bar over `seconds` of sound.
pub(crate) fn of_sound(seconds: f64) -> Bar {
    let bar = ProgressBar::new(in_tenths(seconds));
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} % {msg}") {
        bar.set_style(style);
    }
    Bar(bar)
}

/// A bar over the whole of some work, 1, with the time that is left.
pub(crate) fn of_work() -> Bar {
    let bar = ProgressBar::new(in_tenths(SHARES));
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %, {eta} left") {
        bar.set_style(style);
    }
    Bar(bar)
}

/// Steps of a bar over shares of work.
pub(crate) const SHARES: f64 = 100.0;

pub(crate) struct Bar(ProgressBar);

impl Bar {
    pub(crate) fn at(&self, seconds: f64) {
        self.0.set_position(in_tenths(seconds));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Reports a sound that has been written: its length, and how fast it was made.
pub(crate) fn done(output: &Path, frames: u64, rate_hz: f64, began: Instant) {
    let (sound, took) = (frames as f64 / rate_hz, began.elapsed().as_secs_f64());
    report::line(format_args!(
        "{}: {sound:.2} s of sound in {took:.2} s, {:.0} times real time",
        output.display(),
        sound / took.max(1e-9)
    ));
}

fn in_tenths(seconds: f64) -> u64 {
    (10.0 * seconds) as u64
}
