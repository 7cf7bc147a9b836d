//! A bar on standard error, when that is a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `seconds` of sound.
pub(crate) fn of_sound(seconds: f64) -> Bar {
    let bar = ProgressBar::new(in_tenths(seconds));
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} % {msg}") {
        bar.set_style(style);
    }
    Bar(bar)
}

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

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and it is only a bar")]
fn in_tenths(seconds: f64) -> u64 {
    (10.0 * seconds) as u64
}
