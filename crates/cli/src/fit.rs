//! `promenade fit`: what measurements tell of a room, and how well it foretells others.

mod echoes;
mod evaluate;
mod full;
mod pieces;
mod room;
mod scene;

pub(crate) use room::walls;

use pieces::Pieces;
use room::Stated;

use crate::args::FitArgs;
use crate::report;
use anyhow::{Result, bail};
use promenade_audio::atomic;
use promenade_fit::{
    FlatRoom, Foretold, FullFit, MaterialsBeside, Measurements, QuickFit, absorption_svg, box_obj, decays_svg, full_json,
    full_markdown, full_obj, json, markdown, plan_svg, quick_fit,
};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A room that was fitted.
enum Fitted {
    Quick(Box<QuickFit>),
    Full(Box<FullFit>),
}

pub(crate) fn run(args: &FitArgs) -> Result<()> {
    let (room, path) = match &args.of[..] {
        [room, path] => (Some(Stated::new(room, args)?), path),
        [path, ..] => (None, path),
        [] => bail!("expected measurements"),
    };
    if let Some(output) = &args.output {
        ending(output)?;
    }
    let pieces = Pieces::of(args)?;
    if echoes::has(path) {
        return echoes::run(args, path);
    }
    let set = Measurements::load(path, &args.set.options())?;
    report::notes(&set.notes);
    if args.evaluate {
        evaluate::held_out(args, room.as_ref(), pieces.as_ref(), &set)?;
    }
    if args.output.is_none() && args.changed.is_none() {
        return Ok(());
    }
    let room = room.unwrap_or(Stated::Nothing).room(&set)?;
    let fit = fitted(args, &room, pieces.as_ref(), &set)?;
    if let Some(output) = &args.output {
        write(args, output, &room, &fit, &set)?;
    }
    if let Some(changed) = &args.changed {
        evaluate::changed(args, changed, &fit, &set)?;
    }
    Ok(())
}

fn ending(output: &Path) -> Result<()> {
    if output.extension().is_none_or(|e| e != "promenade" && e != "obj") {
        bail!("{}: expected a file ending in .obj or .promenade", output.display());
    }
    Ok(())
}

fn fitted(args: &FitArgs, room: &FlatRoom, pieces: Option<&Pieces>, set: &Measurements) -> Result<Fitted> {
    let began = Instant::now();
    let fit = if args.quick {
        Fitted::Quick(Box::new(quick_fit(&room::of_box(room)?, set, args.seed)?))
    } else {
        Fitted::Full(Box::new(full::fit(args, room, pieces, set)?))
    };
    report::line(format_args!("{}: fitted in {:.1} s", set.title, began.elapsed().as_secs_f64()));
    match &fit {
        Fitted::Quick(fit) => {
            for hz in fit.missing_hz() {
                report::note(format_args!("the octave about {hz} Hz is not fitted: no response decays by 25 dB there"));
            }
        }
        Fitted::Full(fit) => {
            for hz in &fit.missing_hz {
                report::note(format_args!("no reverberation is known of the octave about {hz} Hz"));
            }
            pieces::say(fit);
            let open = fit.undetermined();
            if !open.is_empty() {
                report::note(format_args!("not determined by these data: {}", open.join(", ")));
            }
        }
    }
    Ok(fit)
}

fn write(args: &FitArgs, output: &Path, stated: &FlatRoom, fit: &Fitted, set: &Measurements) -> Result<()> {
    let made = format!("fit of {} to {} responses, promenade {}", set.title, set.all.len(), env!("CARGO_PKG_VERSION"));
    let svg = output.with_extension("report.svg");
    let picture = report::file_name(&svg);
    let plan = output.with_extension("report.plan.svg");
    let decays = output.with_extension("report.decays.svg");
    let decay = report::file_name(&decays);
    let (beside, mesh, text, numbers, drawn, foretold) = match fit {
        Fitted::Quick(fit) => (
            MaterialsBeside::of(fit, &made),
            box_obj(&fit.walls),
            markdown(fit, set, [&picture, &decay]),
            json(fit, set),
            absorption_svg(&fit.curves()),
            Foretold::new(fit, set),
        ),
        Fitted::Full(fit) => (
            MaterialsBeside::of_full(fit, &made),
            full_obj(fit)?,
            full_markdown(fit, set, [&picture, &report::file_name(&plan), &decay]),
            full_json(fit, set),
            absorption_svg(&fit.curves()),
            Some(Foretold::of_full(fit, set)),
        ),
    };
    let mut files: Vec<(PathBuf, String)> = vec![
        (output.with_extension("obj"), mesh),
        (output.with_extension("materials.json"), serde_json::to_string_pretty(&beside)? + "\n"),
        (output.with_extension("report.md"), text),
        (output.with_extension("report.json"), serde_json::to_string_pretty(&numbers)? + "\n"),
        (svg, drawn),
    ];
    if let Some(foretold) = foretold {
        files.push((decays, decays_svg(&foretold, set)));
    }
    if let Fitted::Full(fit) = fit {
        files.push((plan, plan_svg(stated, fit, set)?));
    }
    for (path, text) in &files {
        atomic::write(path, text.as_bytes())?;
        report::line(path.display());
    }
    if output.extension().is_some_and(|e| e == "promenade") {
        match fit {
            Fitted::Quick(fit) => scene::of_box(args, output, fit, set, &beside)?,
            Fitted::Full(fit) => scene::of_room(args, output, fit, set, &beside)?,
        }
    }
    Ok(())
}
