//! Tables and cells of reports.

use crate::bands::Estimate;
use crate::measurements::{Errors, Measurements};
use crate::prediction::Row;
use std::fmt::Write;

pub(super) fn cell(e: &Estimate) -> String {
    format!("{:.2} ± {:.2}{}", e.value, e.error, if e.determined { "" } else { " ?" })
}

/// A row of a table, its name first.
pub(super) fn row(name: &str, values: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(name.to_owned()).chain(values).collect()
}

/// A table in Markdown, its first row the head.
pub(super) fn markdown_table(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        let _ = writeln!(text, "| {} |", row.join(" | "));
        if i == 0 {
            let _ = writeln!(text, "|---|{}", "---:|".repeat(row.len() - 1));
        }
    }
    text
}

/// The beginning of a report: title, what was fitted, the picture of decays, and notes of the measurements.
pub(super) fn begin(set: &Measurements, fitted: &str, decays: &str) -> String {
    let (count, rate) = (set.all.len(), set.sample_rate_hz);
    let mut text = format!(
        "# {}\n\n{fitted} fitted to {count} responses at {rate} Hz: walls, places, clocks, surfaces, scattering \
         and source.\n\n![Decays by octave]({decays})\n\n",
        set.title
    );
    for note in &set.notes {
        let _ = writeln!(text, "- {note}");
    }
    text
}

/// Names and errors of rows, for a table.
#[must_use]
pub fn table(rows: &[Row]) -> Vec<Vec<String>> {
    let digits = [2, 2, 1, 1, 1, 2, 2, 2];
    let line = |of: &Row| row(&of.name, of.errors.row().into_iter().zip(digits).map(|(v, d)| format!("{v:.d$}")));
    std::iter::once(row("held out", Errors::NAMES.iter().map(|n| (*n).to_owned()))).chain(rows.iter().map(line)).collect()
}
