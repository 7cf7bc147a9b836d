//! Predictions at places that were held out, beside all baselines.

use crate::baselines::Baseline;
use crate::error::FitError;
use crate::figures::{Convention, Errors, Figures};
use crate::flat_room::FlatRoom;
use crate::foretell::Foretold;
use crate::full_fit::{FullFit, FullOptions, full_fit};
use crate::measurements::Measurements;
use crate::quick::{QuickFit, quick_fit};
use crate::random::Random;
use crate::walls::Walls;
use rayon::prelude::*;

/// Which measurements are fitted to and which are held out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Split {
    /// Numbers of those that are fitted to.
    pub train: Vec<usize>,
    /// Numbers of the others.
    pub test: Vec<usize>,
}

impl Split {
    /// `train` of `count` measurements drawn by a seed.
    ///
    /// # Errors
    /// None to fit to or none held out.
    pub fn drawn(count: usize, train: usize, seed: u64) -> Result<Self, FitError> {
        if train == 0 || train >= count {
            return Err(FitError::argument("places to fit to", format!("1 to {}", count.saturating_sub(1)), train));
        }
        let train = Random::new(seed, 0).choose(train, count);
        Ok(Self::of(train, count))
    }

    /// These, and all others of `count` held out.
    #[must_use]
    pub fn of(train: Vec<usize>, count: usize) -> Self {
        let test = (0..count).filter(|i| !train.contains(i)).collect();
        Self { train, test }
    }
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Which prediction.
    pub name: String,
    /// Its errors.
    pub errors: Errors,
}

/// Figures of all responses.
#[must_use]
pub fn all_figures(set: &Measurements, convention: Convention) -> Vec<Figures> {
    set.all.par_iter().map(|m| Figures::of(&m.samples, f64::from(set.sample_rate_hz), convention)).collect()
}

/// What baselines are off at held-out places.
#[must_use]
pub fn baselines(set: &Measurements, figures: &[Figures], split: &Split, convention: Convention) -> Vec<Row> {
    let train = set.only(&split.train);
    let known: Vec<Figures> = split.train.iter().map(|i| figures[*i].clone()).collect();
    let held: Vec<Figures> = split.test.iter().map(|i| figures[*i].clone()).collect();
    let tail = Foretold::without_room(&train)
        .map_or_else(|| Errors::of(&[]), |tail| foretold_errors(&tail, &set.only(&split.test), &held, convention));
    let tail = Row { name: "tail without images".to_owned(), errors: tail };
    Baseline::ALL
        .iter()
        .map(|baseline| {
            let predicted: Vec<Option<Figures>> =
                split.test.par_iter().map(|i| baseline.predict(&set.all[*i], &train, &known, convention)).collect();
            let pairs: Vec<(&Figures, &Figures)> =
                predicted.iter().zip(&split.test).filter_map(|(p, i)| Some((p.as_ref()?, &figures[*i]))).collect();
            Row { name: baseline.name().to_owned(), errors: Errors::of(&pairs) }
        })
        .chain([tail])
        .collect()
}

/// What a quick fit to the measurements of a split is off at the others.
///
/// # Errors
/// As [`quick_fit`].
pub fn quick_row(
    walls: &Walls,
    set: &Measurements,
    figures: &[Figures],
    split: &Split,
    convention: Convention,
    seed: u64,
) -> Result<Row, FitError> {
    let train = set.only(&split.train);
    let fit = quick_fit(walls, &train, seed)?;
    let test = set.only(&split.test);
    let known: Vec<Figures> = split.test.iter().map(|i| figures[*i].clone()).collect();
    Ok(Row { name: "quick fit".to_owned(), errors: errors(&fit, &train, &test, &known, convention) })
}

/// What a full fit to the measurements of a split is off at the others. `each` is told the share of the work that is done.
///
/// # Errors
/// As [`full_fit`].
pub fn full_row(
    room: &FlatRoom,
    set: &Measurements,
    figures: &[Figures],
    split: &Split,
    convention: Convention,
    options: &FullOptions,
    each: &mut dyn FnMut(f64),
) -> Result<Row, FitError> {
    let train = set.only(&split.train);
    let fit = full_fit(room, &train, options, None, &mut |_, share| {
        each(share);
        Ok(())
    })?;
    Ok(fit_row("full fit", &fit, set, figures, split, convention))
}

/// What a full fit that was made of the measurements of a split is off at the others.
#[must_use]
pub fn fit_row(
    name: &str,
    fit: &FullFit,
    set: &Measurements,
    figures: &[Figures],
    split: &Split,
    convention: Convention,
) -> Row {
    let test = set.only(&split.test);
    let known: Vec<Figures> = split.test.iter().map(|i| figures[*i].clone()).collect();
    let errors = foretold_errors(&Foretold::of_full(fit, &set.only(&split.train)), &test, &known, convention);
    Row { name: name.to_owned(), errors }
}

/// How far what is foretold is off at measurements, the mean over draws of noise.
#[must_use]
pub fn foretold_errors(foretold: &Foretold, at: &Measurements, figures: &[Figures], convention: Convention) -> Errors {
    let found: Vec<Option<Figures>> = at.all.par_iter().map(|m| foretold.figures(m, convention)).collect();
    let pairs: Vec<(&Figures, &Figures)> = found.iter().zip(figures).filter_map(|(f, m)| Some((f.as_ref()?, m))).collect();
    Errors::of(&pairs)
}

/// How far a fit to some measurements is off at others, the mean over draws of noise.
#[must_use]
pub fn errors(fit: &QuickFit, train: &Measurements, at: &Measurements, figures: &[Figures], convention: Convention) -> Errors {
    match Foretold::new(fit, train) {
        Some(foretold) => foretold_errors(&foretold, at, figures, convention),
        None => Errors::of(&[]),
    }
}

/// Rows of the same names, averaged over splits, in the order of the first.
#[must_use]
pub fn mean_rows(tables: &[Vec<Row>]) -> Vec<Row> {
    let Some(first) = tables.first() else { return Vec::new() };
    let mean = |row: &Row| {
        let of_name = tables.iter().filter_map(|t| t.iter().find(|r| r.name == row.name)).map(|r| r.errors);
        Row { name: row.name.clone(), errors: Errors::mean(&of_name.collect::<Vec<Errors>>()) }
    };
    first.iter().map(mean).collect()
}
