//! The head that a simulation is heard with.

use crate::report;
use anyhow::{Context, Result};
use promenade_baker::simulation::Hrtf;
use promenade_baker::{LoadOptions, Responses};
use std::path::Path;

/// A set of head-related responses.
pub(crate) fn read(path: &Path) -> Result<Responses> {
    Ok(Responses::load(path, &LoadOptions::default())?)
}

/// What is made of a set at a rate; `path` is for the message.
pub(crate) fn at(set: &Responses, rate_hz: u32, path: &Path) -> Result<Hrtf> {
    let hrtf = Hrtf::new(set, rate_hz).with_context(|| format!("{}: makes no HRTF", path.display()))?;
    if let Some(note) = &hrtf.note {
        report::note(format_args!("{}: heard {note}", path.display()));
    }
    Ok(hrtf)
}
