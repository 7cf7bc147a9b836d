//! Fits with their progress.

use super::patches::{self, Patches};
use crate::args::{FitArgs, Hold};
use crate::report;
use anyhow::{Context, Result};
use promenade_fit::{FitError, FlatRoom, FullFit, FullOptions, Measurements, full_fit};
use std::time::Instant;

/// Share of the work that whole surfaces are, where patches come after them.
const WHOLE: f64 = 0.6;

/// What is done with measurements.
pub(super) struct Fitter<'a> {
    pub(super) args: &'a FitArgs,
    pub(super) patches: Option<Patches>,
}

impl Fitter<'_> {
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

    /// The fit of whole surfaces, and of their patches where these are asked for. `each` is told the share of the work that is
    /// done.
    pub(super) fn full(
        &self,
        room: &FlatRoom,
        set: &Measurements,
        each: &mut dyn FnMut(f64),
    ) -> Result<(FullFit, Option<FullFit>), FitError> {
        let whole = if self.patches.is_some() { WHOLE } else { 1.0 };
        let fit = full_fit(room, set, &self.options(), &mut |share| each(whole * share))?;
        let rest = &mut |share| each(whole + (1.0 - whole) * share);
        let patches = self.patches.as_ref().map(|patches| patches.fit(&fit, set, self.args.seed, rest)).transpose()?;
        Ok((fit, patches))
    }

    /// The fit that is asked for.
    pub(super) fn asked(&self, room: &FlatRoom, set: &Measurements) -> Result<FullFit> {
        let began = Instant::now();
        self.patches.as_ref().map_or(Ok(()), |patches| patches.check(room))?;
        let bar = report::Bar::new("fitting", 1.0);
        let (whole, patches) = self.full(room, set, &mut |share| bar.at(share)).with_context(|| set.title.clone())?;
        drop(bar);
        let fit = patches.unwrap_or(whole);
        report::line(format_args!("{}: fitted in {:.1} s", set.title, began.elapsed().as_secs_f64()));
        patches::say(&fit);
        fit.doubts().iter().for_each(report::note);
        Ok(fit)
    }
}
