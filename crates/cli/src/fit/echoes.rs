//! A box from picked times of echoes.

use crate::args::FitArgs;
use crate::report;
use anyhow::{Result, bail};
use promenade_audio::atomic;
use promenade_fit::{WALLS, box_obj, dechorate_echoes, echo_box};
use std::path::Path;

/// The file of a folder that has them.
const PICKED: &str = "echo_pickpeaking.csv";

/// Whether a folder has times of echoes and no responses.
pub(super) fn has(folder: &Path) -> bool {
    folder.join(PICKED).is_file()
}

pub(super) fn run(args: &FitArgs, folder: &Path) -> Result<()> {
    if args.evaluate || args.changed.is_some() || args.of.len() > 1 {
        bail!("{}: expected responses, found times of echoes, from which walls alone are found", folder.display());
    }
    let all = dechorate_echoes(folder)?;
    let found = echo_box(&all)?;
    let walls = found.walls();
    walls.check()?;
    let head = ["wall", "at, m", "standard error, m", "echoes that agree", "median, m", "column"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for (name, wall) in WALLS.iter().zip(&found.walls) {
        rows.push(vec![
            (*name).to_owned(),
            format!("{:.3}", wall.at_m),
            format!("{:.3}", wall.error_m),
            format!("{} of {}", wall.agree.0, wall.agree.1),
            format!("{:.3}", wall.median_m),
            format!("{}", wall.column + 1),
        ]);
    }
    report::print(&report::table(&rows, args.markdown))?;
    let [x, y, z] = walls.size_m();
    report::line(format_args!("a box of {x:.3} x {y:.3} x {z:.3} m by {} pairs, at {:.1} m/s", all.len(), found.speed_m_s));
    if let Some(output) = &args.output {
        if output.extension().is_none_or(|e| e != "obj") {
            bail!("{}: expected a file ending in .obj: echoes tell no material", output.display());
        }
        atomic::write(output, box_obj(&walls).as_bytes())?;
        report::line(output.display());
    }
    Ok(())
}
