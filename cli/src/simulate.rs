//! `promenade simulate`: responses of rooms that nobody has measured.

use crate::args::{Simulate, SimulateBoxArgs};
use crate::{path, progress, report};
use anyhow::{Context, Result};
use promenade_baker::simulation::{BoxOptions, BoxRoom, Hrtf, along, fit, random_poses, simulate_box};
use promenade_baker::{LoadOptions, Responses};
use promenade_core::Pose;
use promenade_paths::ImportOptions;

pub(crate) fn run(what: &Simulate) -> Result<()> {
    match what {
        Simulate::Box(args) => box_room(args),
    }
}

fn box_room(args: &SimulateBoxArgs) -> Result<()> {
    let room = BoxRoom { size: args.size, absorption: args.absorption };
    let poses = poses(args, &room)?;
    let set = Responses::load(&args.head, &LoadOptions::default())?;
    let hrtf = Hrtf::new(&set, args.rate).with_context(|| format!("{}: makes no HRTF", args.head.display()))?;
    let options = BoxOptions { sample_rate_hz: args.rate, order: args.order, length_s: args.length, seed: args.seed };
    let bar = progress::of_sound(poses.len() as f64);
    let mut responses = simulate_box(&room, args.emitter, &hrtf, &poses, &options, |done| bar.at(done as f64))?;
    drop(bar);
    responses.notes.push(format!(
        "simulated by promenade {}: image sources up to order {}, tail with seed {}, head {} of {} directions",
        env!("CARGO_PKG_VERSION"),
        args.order,
        args.seed,
        set.title,
        hrtf.directions()
    ));
    responses.save(&args.output)?;
    let times: Vec<String> = room.eyring_t60_s().iter().map(|t| format!("{t:.2}")).collect();
    let frames = responses.responses.first().map_or(0, |r| r.left.len());
    report::note(format_args!("reverberation times after Eyring, octaves from 125 Hz to 8 kHz: {} s", times.join(", ")));
    report::line(format_args!(
        "{}: {} responses of {:.2} s at {} Hz",
        args.output.display(),
        responses.responses.len(),
        frames as f64 / f64::from(args.rate),
        args.rate
    ));
    Ok(())
}

fn poses(args: &SimulateBoxArgs, room: &BoxRoom) -> Result<Vec<Pose>> {
    let Some(file) = &args.path else {
        let count = args.poses.unwrap_or(100) as usize;
        return Ok(random_poses(room, args.emitter, count, args.margin, args.seed)?);
    };
    let walk = path::read(file, &ImportOptions::default())?;
    report::notes(&walk.notes);
    let poses = match args.poses {
        Some(count) => along(&walk.path, count as usize),
        None => walk.path.keyframes().iter().map(|k| k.pose).collect(),
    };
    match args.fit {
        Some(margin) => fit(&poses, room, margin).with_context(|| format!("{}: does not fit", file.display())),
        None => Ok(poses),
    }
}
