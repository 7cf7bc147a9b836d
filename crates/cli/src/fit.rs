//! `promenade fit`: what measurements tell of a room, and how well it predicts others.

mod evaluate;
mod fitter;
mod patches;
mod pictures;
mod room;
mod scene;
mod write;

pub(crate) use room::walls;

use crate::args::FitArgs;
use crate::report;
use anyhow::{Result, bail};
use fitter::Fitter;
use patches::Patches;
use promenade_fit::Measurements;
use room::Stated;

pub(crate) fn run(args: &FitArgs) -> Result<()> {
    let (room, path) = match &args.of[..] {
        [room, path] => (Some(Stated::new(room, args)?), path),
        [room, ..] if room::is_mesh(room) => bail!("{}: expected measurements after the room, found none", room.display()),
        [path, ..] => (None, path),
        [] => bail!("expected measurements"),
    };
    if let Some(output) = &args.output {
        write::check_ending(output)?;
        args.less.check(output)?;
    }
    let patches = Patches::of(args)?;
    let set = Measurements::load(path, &args.set.options())?;
    report::notes(&set.notes);
    let fitter = Fitter { args, patches };
    if args.evaluate {
        evaluate::held_out(&fitter, room.as_ref(), &set)?;
    }
    if args.output.is_none() && args.changed.is_none() {
        return Ok(());
    }
    let room = room.unwrap_or(Stated::Nothing).room(&set)?;
    let mut fit = fitter.asked(&room, &set)?;
    if let Some(output) = &args.output {
        write::all(args, output, &fit, &set)?;
    }
    if let Some(changed) = &args.changed {
        evaluate::changed(args, changed, &mut fit, &set)?;
    }
    Ok(())
}
