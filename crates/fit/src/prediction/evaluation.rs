//! Predictions at places that were held out, beside all baselines.

use super::baselines::Baseline;
use super::predict::Prediction;
use super::room_model::RoomModel;
use crate::error::FitError;
use crate::measurements::{Errors, Figures, Measurements};
use crate::numerics::Random;
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
pub fn all_figures(set: &Measurements) -> Vec<Figures> {
    set.all.par_iter().map(|m| Figures::of(&m.samples, f64::from(set.sample_rate_hz))).collect()
}

/// What baselines are off at held-out places.
#[must_use]
pub fn baselines(set: &Measurements, figures: &[Figures], split: &Split) -> Vec<Row> {
    let train = set.only(&split.train);
    let known: Vec<Figures> = split.train.iter().map(|i| figures[*i].clone()).collect();
    Baseline::ALL
        .iter()
        .map(|baseline| {
            let predicted: Vec<Option<Figures>> =
                split.test.par_iter().map(|i| baseline.predict(&set.all[*i], &train, &known)).collect();
            let pairs: Vec<(&Figures, &Figures)> =
                predicted.iter().zip(&split.test).filter_map(|(p, i)| Some((p.as_ref()?, &figures[*i]))).collect();
            Row { name: baseline.name().to_owned(), errors: Errors::of(&pairs) }
        })
        .collect()
}

/// How far a room that was fitted to the measurements of a split is off at the others.
#[must_use]
pub fn fit_row(name: &str, fit: &dyn RoomModel, set: &Measurements, figures: &[Figures], split: &Split) -> Row {
    let known: Vec<Figures> = split.test.iter().map(|i| figures[*i].clone()).collect();
    let (train, test) = (set.only(&split.train), set.only(&split.test));
    Row { name: name.to_owned(), errors: prediction_errors(fit, &train, &test, &known) }
}

/// How far a room that was fitted to some measurements is off at others, whose figures are known: the mean over draws of noise.
#[must_use]
pub fn prediction_errors(fit: &dyn RoomModel, train: &Measurements, at: &Measurements, figures: &[Figures]) -> Errors {
    let Some(prediction) = Prediction::new(fit, train) else { return Errors::of(&[]) };
    let found: Vec<Option<Figures>> = at.all.par_iter().map(|m| prediction.figures(m)).collect();
    let pairs: Vec<(&Figures, &Figures)> = found.iter().zip(figures).filter_map(|(f, m)| Some((f.as_ref()?, m))).collect();
    Errors::of(&pairs)
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
