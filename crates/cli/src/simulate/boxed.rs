//! `promenade simulate box`: a room of six walls.

use super::{Run, head_of, is_there, walk};
use crate::args::SimulateBoxArgs;
use crate::report;
use anyhow::{Context, Result};
use promenade_acoustics::{Air, Shoebox};
use promenade_baker::simulation::{Simulated, fit, random_poses, simulate_box};
use promenade_core::Pose;
use std::time::Instant;

/// Sample rate of a box's responses unless told, hertz.
const RESPONSES_HZ: u32 = 24_000;

pub(super) fn run(args: &SimulateBoxArgs) -> Result<()> {
    args.less.check(&args.output)?;
    let walls = walls(args);
    let rate = args.rate.unwrap_or(RESPONSES_HZ);
    let poses = poses(args)?;
    let run = Run {
        began: Instant::now(),
        args: &args.run,
        clips: &args.clips,
        output: &args.output,
        order: args.order,
        beams: 0,
        rays: args.rays,
        rate,
        air: args.air.air(),
        head: head_of(&args.run, rate, [None; 2])?,
    };
    run.check()?;
    let part = run.part_folder(&poses, &[&walls, &args.emitter])?;
    if part.as_deref().is_some_and(is_there) {
        return Ok(());
    }
    let bar = report::Bar::new("simulating", 1.0);
    let count = (1 + args.run.further.len()) as f64;
    let made = run.of_each(args.emitter, |at, from| {
        let done = |share| bar.at(from + share / count);
        Ok(simulate_box(&walls, at, &run.head.1, &poses, &run.options(), done)?)
    })?;
    drop(bar);
    let Simulated { mut responses, images, rays, .. } = made;
    responses.notes.push(run.note(rays));
    let output = run.save(&responses, part.as_deref())?;
    after_eyring(&walls, run.air);
    run.report(output, &responses, (images, rays));
    Ok(())
}

/// The box, with what is known of its walls.
pub(super) fn walls(args: &SimulateBoxArgs) -> Shoebox {
    Shoebox { size: args.size.as_dvec3().to_array(), materials: args.materials.clone() }
}

/// Says how long a box rings.
pub(super) fn after_eyring(walls: &Shoebox, air: Air) {
    let times: Vec<String> = walls.eyring_t60_s(Some(air)).iter().map(|t| format!("{t:.2}")).collect();
    report::note(format_args!("reverberation times after Eyring, octaves from 125 Hz to 8 kHz: {} s", times.join(", ")));
}

fn poses(args: &SimulateBoxArgs) -> Result<Vec<Pose>> {
    let Some(file) = &args.run.path else {
        let count = args.run.poses.unwrap_or(100) as usize;
        return Ok(random_poses(args.size, args.emitter, count, args.margin, args.run.seed)?);
    };
    let poses = walk(file, args.run.poses)?;
    match args.fit {
        Some(margin) => fit(&poses, args.size, margin).with_context(|| format!("{}: does not fit", file.display())),
        None => Ok(poses),
    }
}
