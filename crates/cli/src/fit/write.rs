//! A fitted room as files.

use super::scene;
use crate::args::FitArgs;
use crate::report;
use anyhow::{Result, bail};
use promenade_audio::atomic;
use promenade_fit::{FullFit, MaterialsBeside, Measurements, Prediction, decays_svg};
use std::path::{Path, PathBuf};

pub(super) fn check_ending(output: &Path) -> Result<()> {
    if output.extension().is_none_or(|e| e != "promenade" && e != "obj") {
        bail!("{}: expected a file ending in .obj or .promenade", output.display());
    }
    Ok(())
}

/// The mesh, its materials, the report with its picture, and the scene if one is asked for.
pub(super) fn all(args: &FitArgs, output: &Path, fit: &FullFit, set: &Measurements) -> Result<()> {
    let made = format!("fit of {} to {} responses, promenade {}", set.title, set.all.len(), env!("CARGO_PKG_VERSION"));
    let beside = MaterialsBeside::of(fit, set, &made)?;
    let decays = output.with_extension("report.decays.svg");
    let mut files: Vec<(PathBuf, String)> = vec![
        (output.with_extension("obj"), fit.obj()?),
        (output.with_extension("materials.json"), serde_json::to_string_pretty(&beside)? + "\n"),
        (output.with_extension("report.md"), fit.markdown(set, &report::file_name(&decays))),
        (output.with_extension("report.json"), serde_json::to_string_pretty(&fit.json(set))? + "\n"),
    ];
    if let Some(prediction) = Prediction::new(fit, set) {
        files.push((decays, decays_svg(&prediction, set)));
    }
    for (path, text) in &files {
        atomic::write(path, text.as_bytes())?;
        report::line(path.display());
    }
    if output.extension().is_some_and(|e| e == "promenade") {
        scene::write(args, output, fit, set, &beside)?;
    }
    Ok(())
}
