//! Tables of materials from files of comma-separated values.

use super::catalogue::{Entry, Materials, key};
use crate::error::AcousticsError;
use crate::materials::shares::Shares;
use promenade_audio::file;
use std::path::Path;

/// Largest file, bytes, and rows that all files may have.
const MAX_FILE_BYTES: u64 = 16 << 20;
const MAX_ROWS: usize = 100_000;
/// Frequencies that a column may have, Hz.
const COLUMNS_HZ: std::ops::RangeInclusive<f64> = 10.0..=40_000.0;

impl Materials {
    /// Adds the materials of a file, which go before those of the same names.
    ///
    /// Its first line names the columns: `material`, then `scattering` or `absorption` as what a row states if there is a
    /// column `property` (absorption without), a `description` that may be missing, and frequencies in Hz, octaves or thirds,
    /// in any order. A material with a row of scattering scatters so, another [`crate::SCATTERING`]. A file without such a
    /// line is one material, called as the file: frequencies, absorption and perhaps scattering as three lines of numbers, as
    /// the database BRAS has them.
    ///
    /// # Errors
    /// A file that cannot be read, is no such table, or holds shares outside 0 to 1.
    pub fn add_table(&mut self, path: &Path) -> Result<usize, AcousticsError> {
        let bytes = file::read(path, MAX_FILE_BYTES).map_err(AcousticsError::read(path))?;
        let wrong = |expected: String, found: String| AcousticsError::content(path, expected, found);
        let mut reader = csv::ReaderBuilder::new();
        let mut reader = reader.has_headers(false).flexible(true).trim(csv::Trim::All).from_reader(&bytes[..]);
        let mut rows: Vec<Vec<String>> = Vec::new();
        for row in reader.records() {
            let row = row.map_err(|e| wrong("comma-separated values in UTF-8".into(), e.to_string()))?;
            if row.iter().all(str::is_empty) {
                continue;
            }
            if rows.len() == MAX_ROWS {
                return Err(wrong(format!("at most {MAX_ROWS} rows"), "more".into()));
            }
            rows.push(row.iter().map(str::to_owned).collect());
        }
        let Some((head, rows)) = rows.split_first() else {
            return Err(wrong("a line of columns, or of frequencies".into(), "an empty file".into()));
        };
        if head.iter().all(|word| word.is_empty() || word.parse::<f64>().is_ok()) {
            let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
            return self.add_lines(path, &name, head, rows);
        }
        let column = |name: &str| head.iter().position(|word| word.eq_ignore_ascii_case(name));
        let named = column("material").or_else(|| column("name"));
        let material = named.ok_or_else(|| wrong("a column called material".into(), head.join(",")))?;
        let (property, description) = (column("property"), column("description"));
        let mut count = 0;
        for (number, row) in rows.iter().enumerate() {
            let line = number + 2;
            let cell = |column: usize| row.get(column).map_or("", String::as_str);
            let shares = shares(head, row).map_err(|e| wrong(format!("row {line}: {}", e[0]), e[1].clone()))?;
            let entry = |description: String| Entry {
                description,
                shares: shares.octaves,
                share_63: shares.low,
                fine: shares.fine.clone(),
            };
            let (name, about) = (key(cell(material)), description.map_or("", cell).to_owned());
            match property.map_or("absorption", cell).to_lowercase().as_str() {
                _ if name.is_empty() => return Err(wrong(format!("row {line}: the name of a material"), "none".into())),
                "absorption" | "" => {
                    count += 1;
                    self.absorption.insert(name, entry(about));
                }
                "scattering" => {
                    self.scattering.insert(name, entry(about));
                }
                other => return Err(wrong(format!("row {line}: absorption or scattering"), format!("{other:?}"))),
            }
        }
        if count == 0 {
            return Err(wrong("a row of absorption".into(), format!("{} rows", rows.len())));
        }
        Ok(count)
    }

    /// One material as lines of numbers.
    fn add_lines(&mut self, path: &Path, name: &str, head: &[String], rows: &[Vec<String>]) -> Result<usize, AcousticsError> {
        let [absorption, more @ ..] = rows else {
            return Err(AcousticsError::content(path, "a line of absorption below the frequencies", "none"));
        };
        for (row, table) in [absorption].into_iter().chain(more.first()).zip([&mut self.absorption, &mut self.scattering]) {
            let shares = shares(head, row).map_err(|[expected, found]| AcousticsError::content(path, expected, found))?;
            let description = format!("of {}", path.file_name().unwrap_or_default().to_string_lossy());
            table.insert(key(name), Entry { description, shares: shares.octaves, share_63: shares.low, fine: shares.fine });
        }
        Ok(1)
    }
}

/// The shares of a row in the columns that are frequencies; what was expected and found where they are none.
fn shares(head: &[String], row: &[String]) -> Result<Shares, [String; 2]> {
    let mut bands = Vec::new();
    for (word, value) in head.iter().zip(row) {
        let Ok(hz) = word.trim_end_matches("Hz").trim().parse::<f64>() else { continue };
        if !COLUMNS_HZ.contains(&hz) {
            return Err([format!("frequencies from {} Hz", COLUMNS_HZ.start()), word.clone()]);
        }
        if value.is_empty() {
            continue;
        }
        match value.parse::<f64>() {
            Ok(share) if (0.0..=1.0).contains(&share) => bands.push([hz, share]),
            _ => return Err([format!("a share from 0 to 1 at {word} Hz"), format!("{value:?}")]),
        }
    }
    Shares::of(&bands).ok_or_else(|| ["shares in columns of frequencies".into(), "none".into()])
}
