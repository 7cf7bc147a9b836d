//! What is run: rooms by splits by seeds by methods, in shares; results as files, from which the table is made.

use promenade_baker::evaluate::{Figure, Figures};
use promenade_baker::{BakeError, FileError, atomic};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Methods, in the order of the table.
pub(crate) const METHODS: [&str; 8] = ["mono", "simulation", "naf", "inras", "av-nerf", "train", "train-simulate", "learn"];
/// Those whose result depends on no seed.
const UNSEEDED: [&str; 2] = ["mono", "simulation"];
/// Figures of the table.
const COLUMNS: [Figure; 6] =
    [Figure::RwavsMag, Figure::AvcloudEnv, Figure::AvcloudMag, Figure::AvcloudLre, Figure::Itd, Figure::Ild];

/// One run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) room: String,
    /// The first emitter that is heard in training, from 0.
    pub(crate) split: usize,
    pub(crate) seed: u64,
    pub(crate) method: String,
}

/// What a run found.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Found {
    /// Means over the test clips, by the figures' names.
    pub(crate) figures: BTreeMap<String, f64>,
    /// How long it took, wall.
    pub(crate) seconds: f64,
}

impl Found {
    pub(crate) fn new(mean: &Figures, seconds: f64) -> Self {
        let of = |figure: Figure| Some((figure.name().to_owned(), mean.get(figure)?));
        Self { figures: Figure::ALL.into_iter().filter_map(of).collect(), seconds }
    }
}

impl Run {
    /// All runs, in an order that every share has.
    pub(crate) fn all(rooms: &[String], splits: usize, seeds: u64, methods: &[String]) -> Vec<Self> {
        let mut out = Vec::new();
        for room in rooms {
            for split in 0..splits {
                for method in methods {
                    let seeds = if UNSEEDED.contains(&method.as_str()) { 1 } else { seeds };
                    let run = |seed| Self { room: room.clone(), split, seed, method: method.clone() };
                    out.extend((1..=seeds).map(run));
                }
            }
        }
        out
    }

    /// Name of its files.
    pub(crate) fn name(&self) -> String {
        format!("{}-{}-{}-{}", self.room, self.split + 1, self.method, self.seed)
    }

    pub(crate) fn result(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.json", self.name()))
    }

    /// What was found; `None` where it was not run yet.
    pub(crate) fn found(&self, folder: &Path) -> Result<Option<Found>, BakeError> {
        let file = self.result(folder);
        if !file.is_file() {
            return Ok(None);
        }
        let bytes = std::fs::read(&file).map_err(FileError::read(&file))?;
        serde_json::from_slice(&bytes).map(Some).map_err(|e| BakeError::unreadable(&file, "result of a run", e))
    }

    /// Runs it, unless that was done, and keeps what is found.
    pub(crate) fn once<E: From<BakeError>>(&self, folder: &Path, run: impl FnOnce() -> Result<Found, E>) -> Result<(), E> {
        if self.found(folder)?.is_none() {
            let text = serde_json::to_string_pretty(&run()?).unwrap_or_default() + "\n";
            let file = self.result(folder);
            atomic::write(&file, text.as_bytes())?;
        }
        Ok(())
    }
}

/// Every `of`th run, from the `part`th on, counted from 1.
pub(crate) fn share(runs: &[Run], part: usize, of: usize) -> impl Iterator<Item = &Run> {
    runs.iter().skip(part - 1).step_by(of)
}

/// The table: means over splits and seeds, and how far the seeds' means are spread; and how long a run took. Rows of methods
/// with runs that are missing say how many.
pub(crate) fn table(runs: &[Run], folder: &Path) -> Result<[String; 2], BakeError> {
    let mut head = vec!["room".to_owned(), "method".to_owned()];
    head.extend(COLUMNS.iter().map(|figure| figure.heading().to_owned()));
    let (mut rows, mut times) = (vec![head], vec![["room", "method", "s a run"].map(str::to_owned).to_vec()]);
    let mut groups: Vec<(&str, &str)> = runs.iter().map(|run| (run.room.as_str(), run.method.as_str())).collect();
    groups.sort_by_key(|(room, method)| (runs.iter().position(|r| r.room == *room), METHODS.iter().position(|m| m == method)));
    groups.dedup();
    for (room, method) in groups {
        let own: Vec<&Run> = runs.iter().filter(|run| (run.room.as_str(), run.method.as_str()) == (room, method)).collect();
        let found = own.iter().map(|run| Ok((run.seed, run.found(folder)?))).collect::<Result<Vec<_>, BakeError>>()?;
        let known: Vec<(u64, Found)> = found.into_iter().filter_map(|(seed, found)| Some((seed, found?))).collect();
        let named = match own.len() - known.len() {
            0 => method.to_owned(),
            missing => format!("{method} ({missing} of {} runs missing)", own.len()),
        };
        let mut row = vec![room.to_owned(), named];
        row.extend(COLUMNS.iter().map(|figure| cell(&known, *figure)));
        rows.push(row);
        let seconds = known.iter().map(|(_, found)| found.seconds).sum::<f64>() / known.len() as f64;
        let took = if known.is_empty() { "-".to_owned() } else { format!("{seconds:.1}") };
        times.push(vec![room.to_owned(), method.to_owned(), took]);
    }
    Ok([markdown(&rows), markdown(&times)])
}

/// A figure's mean over splits and seeds, and the standard deviation of the seeds' means.
fn cell(known: &[(u64, Found)], figure: Figure) -> String {
    let mut by_seed: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (seed, found) in known {
        if let Some(value) = found.figures.get(figure.name()) {
            by_seed.entry(*seed).or_default().push(*value);
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let means: Vec<f64> = by_seed.values().map(|values| mean(values)).collect();
    let digits = figure.digits();
    match means.len() {
        0 => "-".to_owned(),
        1 => format!("{:.digits$}", means[0]),
        count => {
            let middle = mean(&means);
            let square = means.iter().map(|m| (m - middle).powi(2)).sum::<f64>() / (count - 1) as f64;
            format!("{middle:.digits$} ±{:.digits$}", square.sqrt())
        }
    }
}

fn markdown(rows: &[Vec<String>]) -> String {
    let line = |row: &Vec<String>| format!("| {} |\n", row.join(" | "));
    let rule = format!("|{}\n", "---|".repeat(rows[0].len()));
    rows.iter().enumerate().map(|(i, row)| if i == 0 { line(row) + &rule } else { line(row) }).collect()
}
