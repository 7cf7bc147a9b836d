//! Echo times of dEchorate (Di Carlo et al. 2021): a box of movable panels, 30 microphones, 4 directed loudspeakers.

use crate::error::FitError;
use promenade_audio::FileError;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// What one microphone heard of one source.
#[derive(Clone, Debug, PartialEq)]
pub struct Echoes {
    /// Where the source is, metres.
    pub source_m: [f64; 3],
    /// Where the microphone is, metres.
    pub microphone_m: [f64; 3],
    /// When the direct sound came, seconds.
    pub direct_s: f64,
    /// When the first echoes of walls came, seconds, in the order of the file's columns, whose names are permuted: which wall
    /// made which has to be found.
    pub echoes_s: Vec<f64>,
}

/// Reads `echo_pickpeaking.csv` and the places in `dEchorate_database.csv`.
///
/// # Errors
/// A file that is missing or has other columns.
pub fn dechorate_echoes(folder: &Path) -> Result<Vec<Echoes>, FitError> {
    let read = |name: &str| {
        let path = folder.join(name);
        fs::read_to_string(&path).map(|text| (path.clone(), text)).map_err(FileError::read(&path))
    };
    let (database, text) = read("dEchorate_database.csv")?;
    let columns = columns(
        &database,
        &text,
        &["src_id", "src_pos_x", "src_pos_y", "src_pos_z", "mic_id", "mic_pos_x", "mic_pos_y", "mic_pos_z"],
    )?;
    let (mut sources, mut microphones) = (BTreeMap::new(), BTreeMap::new());
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields.get(columns[i]).and_then(|f| f.parse::<f64>().ok());
        if let (Some(id), Some(x), Some(y), Some(z)) = (number(0), number(1), number(2), number(3)) {
            sources.insert(id as i64, [x, y, z]);
        }
        if let (Some(id), Some(x), Some(y), Some(z)) = (number(4), number(5), number(6), number(7)) {
            microphones.insert(id as i64, [x, y, z]);
        }
    }
    let (picked, text) = read("echo_pickpeaking.csv")?;
    let header =
        self::columns(&picked, &text, &["mic", "src", "direct", "ceiling", "floor", "west", "south", "east", "north"])?;
    let mut all = Vec::new();
    for (line_number, line) in text.lines().enumerate().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let values: Option<Vec<f64>> = header.iter().map(|c| fields.get(*c)?.parse().ok()).collect();
        let Some(values) = values else {
            return Err(FitError::entry(&picked, format!("line {}", line_number + 1), "a number in each column", line));
        };
        // Counted from 0 here and from 1 there.
        let (microphone, source) = (values[0] as i64 + 1, values[1] as i64 + 1);
        let (Some(microphone_m), Some(source_m)) = (microphones.get(&microphone), sources.get(&source)) else {
            let found = format!("microphone {microphone}, source {source}");
            return Err(FitError::entry(&picked, format!("line {}", line_number + 1), "places in the database", found));
        };
        all.push(Echoes {
            source_m: *source_m,
            microphone_m: *microphone_m,
            direct_s: values[2],
            echoes_s: values[3..].to_vec(),
        });
    }
    Ok(all)
}

fn columns(path: &Path, text: &str, names: &[&str]) -> Result<Vec<usize>, FitError> {
    let header: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let place = |name: &&str| header.iter().position(|h| h == name);
    let missing = |name: &&str| FitError::content(path, format!("a column {name}"), header.join(", "));
    names.iter().map(|name| place(name).ok_or_else(|| missing(name))).collect()
}
