//! Text for the user: tables on standard output, notes on standard error, names in both. All output goes through here but
//! the help of the command line.

use crate::args::{FigureFiles, JsonFile, MarkdownFile};
use anyhow::{Context, Result};
use promenade_baker::file::{is_standard, output_is_taken};
use promenade_baker::{FileError, atomic};
use std::io::{ErrorKind, Write};
use std::path::Path;

pub(crate) use promenade_player::command::terminal::{Bar, done, line, note, notes};
use promenade_player::command::terminal::{escaped, one_line};

/// Prints on standard output, or on standard error where that is a file; a reader that closes it early is no failure.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out: Box<dyn Write> = if output_is_taken() { Box::new(std::io::stderr()) } else { Box::new(std::io::stdout()) };
    match out.write_all(escaped(text).as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        done => done.context("standard output cannot be written"),
    }
}

/// Names and values, aligned, a line for each.
pub(crate) fn properties<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    rows.into_iter().map(|(name, value)| format!("{name:<14}{}\n", one_line(&value))).collect()
}

/// Writes text into a file that is asked for; whether that is standard output.
fn give(file: Option<&Path>, text: impl FnOnce() -> String) -> Result<bool> {
    match file {
        None => return Ok(false),
        Some(file) if is_standard(file) => print(&text())?,
        Some(file) => atomic::write(file, text().as_bytes())?,
    }
    Ok(file.is_some_and(is_standard))
}

/// Writes JSON where it is asked for, and prints text unless that went to standard output.
pub(crate) fn json_or(files: &JsonFile, json: &serde_json::Value, text: impl FnOnce() -> String) -> Result<()> {
    if give(files.json.as_deref(), || format!("{json:#}\n"))? { Ok(()) } else { print(&text()) }
}

/// Writes tables in Markdown where they are asked for, and prints them as text unless that was standard output. `table` makes
/// them, in Markdown if it is told so.
pub(crate) fn markdown_or(files: &MarkdownFile, table: impl Fn(bool) -> String) -> Result<()> {
    if give(files.markdown.as_deref(), || table(true))? { Ok(()) } else { print(&table(false)) }
}

/// Writes figures to the files that are asked for, and prints their tables unless standard output is one. `table` makes them,
/// in Markdown if it is told so.
pub(crate) fn tables(
    json_file: &JsonFile,
    markdown: &MarkdownFile,
    json: &serde_json::Value,
    table: impl Fn(bool) -> String,
) -> Result<()> {
    if give(json_file.json.as_deref(), || format!("{json:#}\n"))? {
        return give(markdown.markdown.as_deref(), || table(true)).map(drop);
    }
    markdown_or(markdown, table)
}

/// [`tables`] with `plots`, which writes into a folder.
pub(crate) fn figures(
    files: &FigureFiles,
    json: &serde_json::Value,
    table: impl Fn(bool) -> String,
    plots: impl FnOnce(&Path) -> Result<()>,
) -> Result<()> {
    if let Some(folder) = &files.plot {
        std::fs::create_dir_all(folder).map_err(FileError::write(folder))?;
        plots(folder)?;
    }
    tables(&files.json, &files.markdown, json, table)
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
