//! Fits with their progress; a full fit is kept, so that it goes on where it was stopped.

use super::patches::{self, Patches};
use super::room;
use crate::args::{FitArgs, Hold};
use crate::report;
use anyhow::{Context, Result};
use promenade_audio::atomic;
use promenade_fit::{FitError, FittedRoom, FlatRoom, FullFit, FullOptions, Measurements, QuickFit, Saved, full_fit, quick_fit};
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

/// Share of the work that whole surfaces are, where patches come after them.
const WHOLE: f64 = 0.6;

/// What is done with measurements.
pub(super) struct Fitter<'a> {
    pub(super) args: &'a FitArgs,
    pub(super) patches: Option<Patches>,
}

impl Fitter<'_> {
    pub(super) fn quick(&self, room: &FlatRoom, set: &Measurements) -> Result<QuickFit> {
        Ok(quick_fit(&room::of_box(room)?, set, self.args.seed)?)
    }

    fn options(&self) -> FullOptions {
        let free = |what: Hold| !self.args.hold.contains(&what);
        FullOptions {
            order: self.args.order,
            geometry: free(Hold::Walls),
            places: free(Hold::Places),
            source: free(Hold::Source),
            seed: self.args.seed,
            ..FullOptions::default()
        }
    }

    /// The full fit of whole surfaces, and of their patches where these are asked for. `keep` is told every state of the first,
    /// `each` the share of the work that is done.
    pub(super) fn full(
        &self,
        room: &FlatRoom,
        set: &Measurements,
        from: Option<Saved>,
        keep: &dyn Fn(&Saved) -> Result<(), FitError>,
        each: &mut dyn FnMut(f64),
    ) -> Result<(FullFit, Option<FullFit>), FitError> {
        let whole = if self.patches.is_some() { WHOLE } else { 1.0 };
        let fit = full_fit(room, set, &self.options(), from, &mut |state, share| {
            each(whole * share);
            keep(state)
        })?;
        // Patches are found anew from the last state of whole surfaces, which stays until they are.
        let rest = &mut |share| each(whole + (1.0 - whole) * share);
        let patches = self.patches.as_ref().map(|patches| patches.fit(&fit, set, self.args.seed, rest)).transpose()?;
        Ok((fit, patches))
    }

    /// The fit that is asked for; a full one goes on from its state beside the output, if there is one.
    pub(super) fn kept(&self, room: &FlatRoom, set: &Measurements) -> Result<Box<dyn FittedRoom>> {
        let began = Instant::now();
        let fit: Box<dyn FittedRoom> =
            if self.args.quick { Box::new(self.quick(room, set)?) } else { Box::new(self.resumed(room, set)?) };
        report::line(format_args!("{}: fitted in {:.1} s", set.title, began.elapsed().as_secs_f64()));
        fit.full().into_iter().for_each(patches::say);
        fit.doubts().iter().for_each(report::note);
        Ok(fit)
    }

    fn resumed(&self, room: &FlatRoom, set: &Measurements) -> Result<FullFit> {
        self.patches.as_ref().map_or(Ok(()), |patches| patches.check(room))?;
        let file = self.args.output.as_ref().map(|output| output.with_extension("fit-state"));
        let read = |file: &PathBuf| {
            let bytes = fs::read(file).with_context(|| format!("{}: cannot be read", file.display()))?;
            Saved::from_bytes(&bytes)
                .with_context(|| format!("{}: no fit to go on from; remove it to begin anew", file.display()))
        };
        let from = file.as_ref().filter(|file| file.is_file()).map(read).transpose()?;
        if let (Some(saved), Some(file)) = (&from, &file) {
            report::note(format_args!("{}: goes on after round {}", file.display(), saved.rounds()));
        }
        let keep = |state: &Saved| match &file {
            Some(file) => Ok(atomic::write(file, &state.to_bytes())?),
            None => Ok(()),
        };
        let bar = report::Bar::new("fitting", 1.0);
        let what = || file.as_ref().map_or_else(|| set.title.clone(), |f| f.display().to_string());
        let found = self.full(room, set, from, &keep, &mut |share| bar.at(share));
        let (whole, patches) = found.with_context(what)?;
        drop(bar);
        if let Some(file) = file.filter(|f| f.exists()) {
            fs::remove_file(&file).with_context(|| format!("{}: cannot be removed", file.display()))?;
        }
        Ok(patches.unwrap_or(whole))
    }
}
