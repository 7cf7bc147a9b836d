//! A fit beside what needs no room.

use super::markdown::{markdown_table, row};
use crate::fits::FullFit;
use crate::measurements::{Errors, Figures, Measurements};
use crate::prediction::{Baseline, all_figures, prediction_errors};

/// Name with its unit, digits, and the error.
type Measure = (&'static str, usize, fn(&Errors) -> f64);

/// What is compared.
const MEASURES: [Measure; 6] = [
    ("octave T20, %", 1, |errors| errors.octave_t20_percent),
    ("octave C50, dB", 2, |errors| errors.octave_c50_db),
    ("loudness, dB", 2, |errors| errors.loudness_db),
    ("C50, dB", 2, |errors| errors.c50_db),
    ("EDT, ms", 1, |errors| errors.edt_ms),
    ("T60, %", 1, |errors| errors.t60_percent),
];

/// Mean errors of the fitted room at the places that it was fitted to, and of a line over the logarithm of the distance at each
/// place, drawn through all others. A room that is no better than that line tells nothing of its walls.
pub(super) fn beside_a_regression(fit: &FullFit, set: &Measurements) -> String {
    let figures = all_figures(set);
    let own = prediction_errors(fit, set, set, &figures);
    let predicted: Vec<Option<Figures>> = (0..set.all.len())
        .map(|left_out| {
            let others: Vec<usize> = (0..set.all.len()).filter(|i| *i != left_out).collect();
            let known: Vec<Figures> = others.iter().map(|i| figures[*i].clone()).collect();
            Baseline::LogDistance.predict(&set.all[left_out], &set.only(&others), &known)
        })
        .collect();
    let pairs: Vec<(&Figures, &Figures)> = predicted.iter().zip(&figures).filter_map(|(p, f)| Some((p.as_ref()?, f))).collect();
    let line = Errors::of(&pairs);
    let of =
        |name: &str, errors: &Errors| row(name, MEASURES.iter().map(|(_, digits, of)| format!("{:.*}", *digits, of(errors))));
    let table = markdown_table(&[
        row("mean errors", MEASURES.iter().map(|(name, ..)| (*name).to_owned())),
        of("this room", &own),
        of(Baseline::LogDistance.name(), &line),
    ]);
    let is_better = |of: fn(&Errors) -> f64| of(&own) < of(&line);
    let worse: Vec<&str> = MEASURES.iter().filter(|(.., of)| !is_better(*of)).map(|(name, ..)| *name).collect();
    let said = match &worse[..] {
        [] => "The room is better in each.".to_owned(),
        worse => format!("**The room is no better than a line without walls in: {}.**", worse.join("; ")),
    };
    format!(
        "\n## Beside a regression\n\n{table}\n{said} The line is drawn through the other places; the room knows them all.\n"
    )
}
