//! `promenade fit`: what measurements tell of a room, and how well it foretells others.

use crate::args::FitArgs;
use crate::report;
use anyhow::Result;
use promenade_fit::{Errors, Measurements, Row, Split, all_figures, baselines, mean_rows};

pub(crate) fn run(args: &FitArgs) -> Result<()> {
    let set = Measurements::load(&args.measurements, &args.set.options())?;
    report::notes(&set.notes);
    evaluate(args, &set)
}

fn evaluate(args: &FitArgs, set: &Measurements) -> Result<()> {
    let convention = args.convention.into();
    let count = set.all.len();
    let places = args.places.unwrap_or(count.div_ceil(3));
    let figures = all_figures(set, convention);
    let splits: Result<Vec<Split>, _> =
        (0..u64::from(args.splits)).map(|i| Split::drawn(count, places, args.seed.wrapping_add(i))).collect();
    let tables: Vec<Vec<Row>> = splits?.iter().map(|split| baselines(set, &figures, split, convention)).collect();
    report::line(format_args!(
        "{}: fitted to {places} of {count} places, judged at the others, {} draws, {} Hz, {}",
        set.title,
        args.splits,
        set.sample_rate_hz,
        convention.name()
    ));
    report::print(&table(&mean_rows(&tables), args.markdown))
}

/// Errors of all rows under their names.
fn table(rows: &[Row], markdown: bool) -> String {
    let head = std::iter::once("held out".to_owned()).chain(Errors::NAMES.iter().map(|n| (*n).to_owned())).collect();
    let line = |row: &Row| {
        let digits = [2, 2, 1, 1, 1, 2, 2, 2];
        let values = row.errors.row().into_iter().zip(digits).map(|(v, d)| format!("{v:.d$}"));
        std::iter::once(row.name.clone()).chain(values).collect()
    };
    let lines: Vec<Vec<String>> = std::iter::once(head).chain(rows.iter().map(line)).collect();
    report::table(&lines, markdown)
}
