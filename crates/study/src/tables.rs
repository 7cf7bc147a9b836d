//! Files of answers and of preference tables.

use crate::answers::{Answer, Answers, HEADER, distinct};
use crate::preferences::Preferences;
use csv::{ReaderBuilder, StringRecord, Trim};
use promenade_audio::{FileError, file};
use std::path::Path;

/// Largest file, bytes.
const MOST_BYTES: u64 = 256 << 20;
/// Most preference tables of a file.
const MOST_TABLES: usize = 1000;
/// Most answers of all files.
const MOST_ANSWERS: usize = 200_000;
/// Most things that are listened to.
const MOST_ITEMS: usize = 1000;

/// What files hold together.
#[derive(Clone, Debug, Default)]
pub struct Material {
    /// Answers of persons.
    pub answers: Answers,
    /// Preference tables by the name of what was compared.
    pub tables: Vec<(String, Preferences)>,
}

/// Reads files, answers as the page writes them (`study,person,...`), or preference tables as papers print them: a line with
/// what was compared and the names of the conditions, and a line for each condition with how often it was preferred to each. A
/// last column `Score` is checked; the cells of a condition against itself may hold anything but a number.
///
/// # Errors
/// A file that cannot be read, is larger than 256 MiB or has a line that is none of those; more than 200,000 answers or 1000
/// items in all.
pub fn read<P: AsRef<Path>>(paths: &[P]) -> Result<Material, FileError> {
    let mut material = Material::default();
    for path in paths {
        let path = path.as_ref();
        let bytes = file::read(path, MOST_BYTES).map_err(FileError::read(path))?;
        add(&mut material, path, &bytes)?;
        let items = distinct(material.answers.list().iter().map(|answer| &*answer.item)).len();
        if items > MOST_ITEMS {
            return Err(FileError::content(path, "at most 1000 items", items.to_string()));
        }
    }
    Ok(material)
}

fn entry(path: &Path, record: &StringRecord, expected: &str, found: String) -> FileError {
    at(path, record)(FileError::unexpected(expected, found))
}

/// For `map_err`: what is wrong with a line.
fn at(path: &Path, record: &StringRecord) -> impl Fn(FileError) -> FileError {
    let line = record.position().map_or(0, csv::Position::line);
    move |error| FileError::new(format!("{}: line {line}: {error}", path.display()))
}

fn add(material: &mut Material, path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(bytes);
    let mut records =
        reader.records().map(|record| record.map_err(|error| FileError::content(path, "lines of CSV", error.to_string())));
    let Some(first) = records.next().transpose()? else {
        return Err(FileError::content(path, "answers or preference tables", "nothing"));
    };
    if first.iter().eq(HEADER) {
        for record in records {
            let record = record?;
            // Files put one after the other have their heads within.
            if !record.iter().eq(HEADER) {
                let answer = Answer::parse(&record.iter().collect::<Vec<_>>());
                if material.answers.list().len() == MOST_ANSWERS {
                    return Err(entry(path, &record, "at most 200000 answers", "another".into()));
                }
                material.answers.add(answer.map_err(|(expected, found)| entry(path, &record, &expected, found))?);
            }
        }
        return Ok(());
    }
    let mut head = Some(first);
    while let Some(record) = head {
        if material.tables.len() == MOST_TABLES {
            return Err(entry(path, &record, "at most 1000 tables", "another".into()));
        }
        let table = table(path, &record, &mut records)?;
        material.tables.push((record[0].to_owned(), table));
        head = records.next().transpose()?;
    }
    Ok(())
}

fn table(
    path: &Path,
    head: &StringRecord,
    records: &mut impl Iterator<Item = Result<StringRecord, FileError>>,
) -> Result<Preferences, FileError> {
    let scored = head.len() > 1 && head[head.len() - 1].eq_ignore_ascii_case("score");
    let names: Vec<String> = head.iter().skip(1).take(head.len() - 1 - usize::from(scored)).map(str::to_owned).collect();
    let mut table = Preferences::new(names.clone()).map_err(at(path, head))?;
    for (row, name) in names.iter().enumerate() {
        let Some(record) = records.next().transpose()? else {
            return Err(FileError::content(path, format_args!("a line for {name}"), "the end of the file"));
        };
        if record.len() != head.len() || record[0] != **name {
            let found = format!("{} cells from {:?} on", record.len(), record.get(0).unwrap_or_default());
            return Err(entry(path, &record, &format!("{} cells from {name:?} on", head.len()), found));
        }
        for column in (0..names.len()).filter(|column| *column != row) {
            let cell = &record[column + 1];
            let votes = cell.parse().map_err(|_| entry(path, &record, "a number of votes", format!("{cell:?}")))?;
            table.add(row, column, votes).map_err(at(path, &record))?;
        }
        if record[row + 1].parse::<f64>().is_ok() {
            return Err(entry(path, &record, "no number for a condition against itself", format!("{:?}", &record[row + 1])));
        }
        let score = table.scores()[row];
        if scored && record[record.len() - 1].parse() != Ok(score) {
            let found = format!("a score of {}", &record[record.len() - 1]);
            return Err(entry(path, &record, &format!("votes that sum to its score, which are {score}"), found));
        }
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Material, String> {
        let mut material = Material::default();
        add(&mut material, Path::new("x.csv"), text.as_bytes()).map(|()| material).map_err(|error| error.to_string())
    }

    #[test]
    fn tables_are_read_as_they_are_printed() {
        let read = of("room,x,y,Score\nx,*,3,3\ny,4,*,4\n\nhall,x,y\nx,,1\ny,2,-\n").unwrap();
        assert_eq!(read.tables.iter().map(|t| &*t.0).collect::<Vec<_>>(), ["room", "hall"]);
        assert_eq!((read.tables[0].1.votes(1, 0), read.tables[1].1.scores()), (4, vec![1, 2]));
    }

    #[test]
    fn wrong_tables_name_their_line() {
        for (text, clue) in [
            (
                "room,x,y,Score\nx,*,3,4\ny,4,*,4\n",
                "line 2: expected votes that sum to its score, which are 3, found a score of 4",
            ),
            ("room,x,y\nx,*,3\n", "a line for y"),
            ("room,x,y\nx,*,many\ny,4,*\n", "a number of votes"),
            ("room,x,y\ny,*,3\nx,4,*\n", "from \"x\" on"),
            ("room,x,y\nx,1,3\ny,4,*\n", "against itself"),
            ("room,x,x\nx,*,3\n", "different names"),
            ("room\n", "2 to 64 conditions"),
            ("", "nothing"),
        ] {
            let said = of(text).unwrap_err();
            assert!(said.contains(clue), "{text:?}: {said}");
        }
    }

    #[test]
    fn answers_are_read_with_their_heads_within() {
        let head = HEADER.join(",");
        let line = "s,p,t,1,paired,room,Mix,Sal,,Sal,,,9.5,passed";
        let read = of(&format!("\u{feff}{head}\r\n{line}\r\n{head}\n{line}\n")).unwrap();
        assert_eq!((read.answers.list().len(), read.answers.repeated), (1, 1));
        assert!(of(&format!("{head}\ns,p\n")).unwrap_err().contains("line 2: expected 14 cells, found 2"));
    }
}
