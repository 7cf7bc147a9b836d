//! The full fit with its progress, kept so that it goes on where it was stopped.

use crate::args::{FitArgs, Hold};
use crate::{progress, report};
use anyhow::{Context, Result};
use promenade_audio::atomic;
use promenade_fit::{FitError, FlatRoom, FullFit, FullOptions, Measurements, Saved, full_fit};
use std::fs;
use std::path::PathBuf;

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

pub(super) fn fit(args: &FitArgs, room: &FlatRoom, set: &Measurements) -> Result<FullFit> {
    let file = args.output.as_ref().map(|output| output.with_extension("fit-state"));
    let from = file.as_ref().filter(|file| file.is_file()).map(|file| {
        let bytes = fs::read(file).with_context(|| format!("{}: cannot be read", file.display()))?;
        Saved::from_bytes(&bytes).with_context(|| format!("{}: no fit to go on from; remove it to begin anew", file.display()))
    });
    let from = from.transpose()?;
    if let (Some(saved), Some(file)) = (&from, &file) {
        report::note(format_args!("{}: goes on after round {}", file.display(), saved.rounds()));
    }
    let fit = run(args, room, set, from, file.as_ref())
        .with_context(|| file.as_ref().map_or_else(|| set.title.clone(), |f| f.display().to_string()))?;
    if let Some(file) = file.filter(|f| f.exists()) {
        fs::remove_file(&file).with_context(|| format!("{}: cannot be removed", file.display()))?;
    }
    Ok(fit)
}

fn run(
    args: &FitArgs,
    room: &FlatRoom,
    set: &Measurements,
    from: Option<Saved>,
    file: Option<&PathBuf>,
) -> Result<FullFit, FitError> {
    let bar = progress::of_work();
    full_fit(room, set, &options(args), from, &mut |state, share| {
        bar.at(progress::SHARES * share);
        match file {
            Some(file) => Ok(atomic::write(file, &state.to_bytes())?),
            None => Ok(()),
        }
    })
}
