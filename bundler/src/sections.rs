//! Named parts of a long command, and how long each took.

use anyhow::Result;
use std::time::{Duration, Instant};

/// The parts so far.
#[derive(Default)]
pub(crate) struct Sections {
    durations: Vec<(&'static str, Duration)>,
}

impl Sections {
    /// Does the work of a part under its heading.
    pub(crate) fn run<T>(&mut self, name: &'static str, work: impl FnOnce() -> Result<T>) -> Result<T> {
        println!("\n=== {name} ===");
        let started = Instant::now();
        let result = work();
        self.durations.push((name, started.elapsed()));
        result
    }

    /// Prints a table, minutes and seconds.
    pub(crate) fn print(&self) {
        println!();
        let all = ("all", self.durations.iter().map(|(_, took)| *took).sum());
        for (name, took) in self.durations.iter().chain([&all]) {
            let seconds = took.as_secs();
            println!("{name:20} {:3}:{:02}", seconds / 60, seconds % 60);
        }
    }
}
