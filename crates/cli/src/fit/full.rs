//! The full fit with its progress, kept so that it goes on where it was stopped.

use super::pieces::Pieces;
use crate::args::{FitArgs, Hold};
use crate::report;
use anyhow::{Context, Result};
use promenade_audio::atomic;
use promenade_fit::{FitError, FlatRoom, FullFit, FullOptions, Measurements, Saved, full_fit};
use std::fs;
use std::path::PathBuf;

/// Share of the work that whole surfaces are, where pieces come after them.
pub(super) const WHOLE: f64 = 0.6;

/// Options of a fit.
pub(super) fn options(args: &FitArgs) -> FullOptions {
    let free = |what: Hold| !args.hold.contains(&what);
    FullOptions {
        order: args.order,
        geometry: free(Hold::Walls),
        places: free(Hold::Places),
        source: free(Hold::Source),
        seed: args.seed,
        ..FullOptions::default()
    }
}

pub(super) fn fit(args: &FitArgs, room: &FlatRoom, pieces: Option<&Pieces>, set: &Measurements) -> Result<FullFit> {
    pieces.map_or(Ok(()), |pieces| pieces.check(room))?;
    let file = args.output.as_ref().map(|output| output.with_extension("fit-state"));
    let from = file.as_ref().filter(|file| file.is_file()).map(|file| {
        let bytes = fs::read(file).with_context(|| format!("{}: cannot be read", file.display()))?;
        Saved::from_bytes(&bytes).with_context(|| format!("{}: no fit to go on from; remove it to begin anew", file.display()))
    });
    let from = from.transpose()?;
    if let (Some(saved), Some(file)) = (&from, &file) {
        report::note(format_args!("{}: goes on after round {}", file.display(), saved.rounds()));
    }
    let fit = run(args, room, pieces, set, from, file.as_ref())
        .with_context(|| file.as_ref().map_or_else(|| set.title.clone(), |f| f.display().to_string()))?;
    if let Some(file) = file.filter(|f| f.exists()) {
        fs::remove_file(&file).with_context(|| format!("{}: cannot be removed", file.display()))?;
    }
    Ok(fit)
}

fn run(
    args: &FitArgs,
    room: &FlatRoom,
    pieces: Option<&Pieces>,
    set: &Measurements,
    from: Option<Saved>,
    file: Option<&PathBuf>,
) -> Result<FullFit, FitError> {
    let bar = report::Bar::new(1.0);
    let whole = if pieces.is_some() { WHOLE } else { 1.0 };
    let fit = full_fit(room, set, &options(args), from, &mut |state, share| {
        bar.at(whole * share);
        match file {
            Some(file) => Ok(atomic::write(file, &state.to_bytes())?),
            None => Ok(()),
        }
    })?;
    // Pieces are found anew from the last state of whole surfaces, which stays until they are.
    match pieces {
        Some(pieces) => pieces.fit(&fit, set, args.seed, &mut |share| bar.at(whole + (1.0 - whole) * share)),
        None => Ok(fit),
    }
}
