//! Text for the user: tables on standard output, notes on standard error, names in both. All output goes through here but
//! the help of the command line.

use crate::args::FigureFiles;
use anyhow::{Context, Result};
use promenade_baker::{FileError, atomic};
use std::io::{ErrorKind, Write};
use std::path::Path;

pub(crate) use promenade_player::command::terminal::{Bar, done, line, note, notes};
use promenade_player::command::terminal::{escaped, one_line};

/// Prints on standard output; a reader that closes it early is no failure.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(escaped(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("standard output cannot be written"),
    }
}

/// A time in minutes and seconds.
#[cfg(feature = "train")]
pub(crate) fn minutes(seconds: f64) -> String {
    let whole = seconds.round().max(0.0);
    format!("{}:{:02}", (whole / 60.0).floor(), whole % 60.0)
}

/// Names and values, aligned, a line for each.
pub(crate) fn properties<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    rows.into_iter().map(|(name, value)| format!("{name:<14}{}\n", one_line(&value))).collect()
}

/// Writes figures to the files that are asked for, and prints their tables. `table` makes them, in Markdown if it is told so;
/// `plots` writes into a folder.
pub(crate) fn figures(
    files: &FigureFiles,
    json: &serde_json::Value,
    table: impl Fn(bool) -> String,
    plots: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    if let Some(file) = &files.json {
        atomic::write(file, format!("{json:#}\n").as_bytes())?;
    }
    if let Some(file) = &files.markdown {
        atomic::write(file, table(true).as_bytes())?;
    }
    if let Some(folder) = &files.plots {
        std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
        plots(folder)?;
    }
    print(&table(false))
}

/// The last part of a path.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Rows under a head, columns aligned: numbers to the right, the first column to the left.
pub(crate) fn table(rows: &[Vec<String>], markdown: bool) -> String {
    let columns = rows.first().map_or(0, Vec::len);
    let widths: Vec<usize> = (0..columns).map(|c| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0)).collect();
    let mut text = String::new();
    for (number, row) in rows.iter().enumerate() {
        let cell = |(c, value): (usize, &String)| {
            let width = widths[c];
            if c == 0 { format!("{value:<width$}") } else { format!("{value:>width$}") }
        };
        let cells: Vec<String> = row.iter().enumerate().map(cell).collect();
        if markdown {
            text += &format!("| {} |\n", cells.join(" | "));
            if number == 0 {
                let rule: Vec<String> = widths
                    .iter()
                    .enumerate()
                    .map(|(c, w)| if c == 0 { "-".repeat(*w) } else { "-".repeat(w - 1) + ":" })
                    .collect();
                text += &format!("| {} |\n", rule.join(" | "));
            }
        } else {
            text += cells.join("  ").trim_end();
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown() {
        let title = "Hall \u{1b}[2J\u{9b}31m\u{7f}\r\tÄ\n";
        assert_eq!(escaped(title), "Hall \\u001b[2J\\u009b31m\\u007f\\u000d\\u0009Ä\n");
        let json = serde_json::json!({ "title": title });
        assert_eq!(serde_json::from_str::<serde_json::Value>(&escaped(&format!("{json:#}\n"))).unwrap(), json);
        assert_eq!(properties([("title", "a\nanchors 3".to_owned())]), "title         a anchors 3\n");
    }

    #[test]
    fn columns_line_up() {
        let rows = [vec!["pose".to_owned(), "dB".to_owned()], vec!["a".to_owned(), "-1.25".to_owned()]];
        assert_eq!(table(&rows, false), "pose     dB\na     -1.25\n");
        assert_eq!(table(&rows, true), "| pose |    dB |\n| ---- | ----: |\n| a    | -1.25 |\n");
    }
}
