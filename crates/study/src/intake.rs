//! Answers that come in: checked against the study, and put at the end of one file.

use crate::answers::{Answer, HEADER, Method, Trial};
use crate::definition::{LOW_ANCHOR, MID_ANCHOR, REFERENCE};
use crate::site::STUDY_FILE;
use promenade_audio::{FileError, file};
use serde::Deserialize;
use std::collections::HashSet;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Mutex;

/// Most rows of a post.
const MOST_ROWS: usize = 20_000;
/// Most characters of a cell, and of an answer to a question.
const MOST_CELL: usize = 128;
const MOST_SAID: usize = 1000;
/// Most bytes of a file of answers.
const MOST_FILE: u64 = 1 << 30;

/// Takes answers of one study into one file, which it only ever makes longer.
pub(crate) struct Intake {
    study: String,
    version: String,
    /// Method, item and condition; of questions their names alone.
    known: HashSet<(String, String, String)>,
    file: Mutex<File>,
}

/// What is posted.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Posted {
    rows: Vec<Vec<String>>,
}

/// What a site's study must say here.
#[derive(Deserialize)]
struct Page {
    study: String,
    version: String,
    questions: Option<Vec<PageSound>>,
    parts: Vec<PagePart>,
}

#[derive(Deserialize)]
struct PagePart {
    method: String,
    items: Vec<PageItem>,
}

#[derive(Deserialize)]
struct PageItem {
    name: String,
    conditions: Vec<PageSound>,
}

#[derive(Deserialize)]
struct PageSound {
    name: String,
}

/// Why answers were not taken.
pub(crate) enum Refusal {
    /// They are none.
    Broken(String),
    /// The file cannot take them.
    Unwritten(String),
}

impl Intake {
    /// Opens a file of answers, which is made with its head where there is none, for the study of a site.
    ///
    /// # Errors
    /// A site without a study, or a file that is none of answers or cannot be written.
    pub(crate) fn open(site: &Path, answers: &Path) -> Result<Self, FileError> {
        let path = site.join(STUDY_FILE);
        let bytes = file::read(&path, 64 << 20).map_err(FileError::read(&path))?;
        let page: Page = serde_json::from_slice(&bytes).map_err(|error| FileError::content(&path, "a study", error))?;
        let questions = page.questions.into_iter().flatten();
        let mut known: HashSet<_> = questions.map(|q| (Method::Question.name().to_owned(), q.name, String::new())).collect();
        for part in &page.parts {
            for item in &part.items {
                let names = item.conditions.iter().map(|sound| &*sound.name).chain([REFERENCE, LOW_ANCHOR, MID_ANCHOR]);
                known.extend(names.map(|name| (part.method.clone(), item.name.clone(), name.to_owned())));
            }
        }
        let mut file =
            OpenOptions::new().read(true).append(true).create(true).open(answers).map_err(FileError::write(answers))?;
        begin(&mut file, answers)?;
        Ok(Self { study: page.study, version: page.version, known, file: Mutex::new(file) })
    }

    /// Takes a post whole or not at all; gives the number of rows.
    pub(crate) fn take(&self, body: &[u8]) -> Result<usize, Refusal> {
        let broken = |error: String| Refusal::Broken(error);
        let posted: Posted = serde_json::from_slice(body).map_err(|error| broken(error.to_string()))?;
        if posted.rows.is_empty() || posted.rows.len() > MOST_ROWS {
            return Err(broken(format!("expected 1 to {MOST_ROWS} rows, found {}", posted.rows.len())));
        }
        let mut lines = csv::Writer::from_writer(Vec::new());
        for (number, row) in posted.rows.iter().enumerate() {
            self.check(row)
                .map_err(|(expected, found)| broken(format!("row {}: expected {expected}, found {found}", number + 1)))?;
            lines.write_record(row).map_err(|error| broken(error.to_string()))?;
        }
        let bytes = lines.into_inner().map_err(|error| broken(error.to_string()))?;
        // A thread that failed has written a whole post or none: the file is as good as before.
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let unwritten = |error: std::io::Error| Refusal::Unwritten(error.to_string());
        let before = file.metadata().map_err(unwritten)?.len();
        if before + bytes.len() as u64 > MOST_FILE {
            return Err(Refusal::Unwritten(format!("the file of answers is full: {before} bytes")));
        }
        if let Err(error) = file.write_all(&bytes).and_then(|()| file.sync_data()) {
            // Half a post would break the line of the next.
            let _ = file.set_len(before);
            return Err(unwritten(error));
        }
        Ok(posted.rows.len())
    }

    fn check(&self, row: &[String]) -> Result<(), (String, String)> {
        let cells: Vec<&str> = row.iter().map(String::as_str).collect();
        let most = if cells.get(6) == Some(&Method::Question.name()) { MOST_SAID } else { MOST_CELL };
        if let Some(cell) = cells.iter().find(|cell| cell.chars().count() > most || cell.chars().any(char::is_control)) {
            let found = cell.chars().take(20).collect::<String>();
            return Err((format!("cells of at most {most} printed characters"), format!("{found:?}")));
        }
        let answer = Answer::parse(&cells)?;
        if answer.study != self.study {
            return Err((format!("answers to {:?}", self.study), format!("{:?}", answer.study)));
        }
        if answer.version != self.version {
            return Err((format!("answers to its version {}", self.version), format!("{:?}", answer.version)));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if answer.person.len() > 64 || !answer.person.chars().all(plain) {
            return Err(("a person's name of letters, digits, - and _".into(), format!("{:?}", answer.person)));
        }
        // Tables on a screen take cells that begin so for formulas.
        let free = [cells[3], cells[4], cells[5], cells[11], cells[12], cells[13], cells[14], cells[15]];
        if let Some(cell) = free.iter().find(|cell| cell.starts_with(['=', '+', '-', '@'])) {
            return Err(("no formulas".into(), format!("{cell:?}")));
        }
        let method = cells[6];
        let none = String::new();
        let names = match &answer.what {
            Trial::Paired { better, worse } => vec![better, worse],
            Trial::Abx { between: [a, b], .. } | Trial::Tie { between: [a, b] } => vec![a, b],
            Trial::Rating { of, .. } => vec![of],
            Trial::Said(_) => vec![&none],
        };
        match names.iter().find(|name| !self.known.contains(&(method.to_owned(), answer.item.clone(), (**name).clone()))) {
            Some(name) => Err(("items and conditions of the study".into(), format!("{:?}, {name:?}", answer.item))),
            None => Ok(()),
        }
    }
}

/// Writes the head of a new file, and looks at that of an old one.
fn begin(file: &mut File, path: &Path) -> Result<(), FileError> {
    let head = HEADER.join(",") + "\n";
    let length = file.metadata().map_err(FileError::read(path))?.len();
    if length == 0 {
        return file.write_all(head.as_bytes()).map_err(FileError::write(path));
    }
    let mut found = vec![0; head.len()];
    file.seek(SeekFrom::Start(0)).and_then(|_| file.read_exact(&mut found)).map_err(FileError::read(path))?;
    if found != head.as_bytes() {
        let expected = format!("a file of answers, which begins with {:?}", head.trim_end());
        return Err(FileError::content(path, expected, format_args!("{:?}", String::from_utf8_lossy(&found))));
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1)).and_then(|_| file.read_exact(&mut last)).map_err(FileError::read(path))?;
    // A machine that lost its power leaves half a line, which must not take the next one with it.
    if last != *b"\n" { file.write_all(b"\n").map_err(FileError::write(path)) } else { Ok(()) }
}
