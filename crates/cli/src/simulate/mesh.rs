//! `promenade simulate ROOM`: a room of a mesh.

use super::room::{room, source, within};
use super::{Run, head_of, is_there, scene, walk};
use crate::args::{RoomArgs, RunArgs, SimulateArgs, SimulateMeshArgs};
use crate::report;
use anyhow::{Result, bail};
use promenade_acoustics::{Air, LateField, MeshReport, Room};
use promenade_baker::simulation::{Inside, Simulated, grid, random_inside, simulate_mesh, turned};
use promenade_core::Pose;
use std::time::Instant;

/// Share of the directions in which a room has a surface, at least.
const LEAST_ENCLOSED: f64 = 0.8;

pub(super) fn run(of: &RoomArgs, args: &SimulateMeshArgs, run: &RunArgs, rest: &SimulateArgs) -> Result<()> {
    let SimulateArgs { air, clips, less, .. } = rest;
    let began = Instant::now();
    let source = source(of)?;
    let (mesh, room, size) = room(of)?;
    if args.output.extension().is_some_and(|e| e == "promenade") {
        if !clips.dry.is_empty() {
            bail!("{}: expected --dry for a capture, found a scene to write", args.output.display());
        }
        return scene::write(&mesh, &room, &source, of, args, (run, *air, *less));
    }
    less.check(&args.output)?;
    let inside = Inside::new(&mesh, &room, of.source, args.margin)?;
    let poses = poses(args, run, &inside)?;
    for pose in poses.iter().filter(|_| size.volume_m3.is_some()) {
        within("listener", &room, &mesh, pose.position)?;
    }
    let (order, beams, rays, rate) = (args.order, args.beams, args.rays, args.rate);
    let head = head_of(run, rate, [args.credit.as_ref(), args.licence.as_ref()])?;
    let run = Run { began, args: run, clips, output: &args.output, order, beams, rays, rate, air: air.air(), head };
    run.check()?;
    let title = args.title.clone().unwrap_or_else(|| report::file_name(&of.mesh));
    let part = run.part_folder(&poses, &[&title, &mesh, &room.materials(), &source])?;
    if part.as_deref().is_some_and(is_there) {
        return Ok(());
    }
    let bar = report::Bar::new("simulating", 1.0);
    let count = (1 + run.args.further.len()) as f64;
    let made = run.of_each(of.source, |at, from| {
        if size.volume_m3.is_some() {
            within("--further", &room, &mesh, at)?;
        }
        let (done, source) = (|share| bar.at(from + share / count), self::source(&RoomArgs { source: at, ..of.clone() })?);
        Ok(simulate_mesh(&mesh, &room, &source, &run.head.1, &poses, &run.options(), done)?)
    })?;
    drop(bar);
    let Simulated { mut responses, late, images, rays, crossover_hz, rings_s } = made;
    responses.title = title;
    responses.notes.push(run.note(rays));
    responses.notes.extend(crossover_hz.map(|hz| format!("below {hz:.0} Hz by waves")));
    let output = run.save(&responses, part.as_deref())?;
    let silent = responses.responses.iter().filter(|r| r.left.iter().chain(&r.right).all(|v| *v == 0.0)).count();
    if silent > 0 {
        report::note(format_args!(
            "nothing of the source arrives at {silent} of {} poses: their responses are silent",
            poses.len()
        ));
    }
    reverberation(&size, &room, run.air, room.surroundings(source.position)?.enclosed);
    decay(&late);
    let length_s = responses.responses.first().map_or(0.0, |r| r.left.len() as f64 / f64::from(rate));
    if let Some(rings_s) = rings_s.filter(|rings_s| *rings_s > 1.01 * length_s) {
        report::note(format_args!(
            "responses end after {length_s:.2} s, and the room rings for {rings_s:.1} s: --length makes them longer"
        ));
    }
    run.report(output, &responses, (images, rays));
    Ok(())
}

/// Times of the octaves from 125 Hz to 8 kHz.
fn times(times: [f64; 7]) -> String {
    let time = |t: &f64| if t.is_finite() { format!("{t:.2}") } else { "no end".to_owned() };
    times.iter().map(time).collect::<Vec<_>>().join(", ")
}

/// Says how long the room rings after Eyring, or that it is too open for that.
fn reverberation(size: &MeshReport, room: &Room, air: Air, enclosed: f64) {
    if enclosed < LEAST_ENCLOSED {
        report::note(format_args!(
            "{:.0} % of the directions from the source meet no surface: there is no reverberation time after Eyring",
            100.0 * (1.0 - enclosed)
        ));
    } else {
        let open = " (of the box about the mesh, which is not closed; its openings take all)";
        let of = if size.volume_m3.is_some() { "" } else { open };
        let volume = size.volume_m3.unwrap_or_else(|| room.bounding_volume());
        report::note(format_args!(
            "{volume:.1} m3{of}, {:.1} m2; after Eyring, octaves from 125 Hz to 8 kHz: {} s",
            size.area_m2,
            times(room.eyring_t60_s(size.volume_m3, Some(air)))
        ));
    }
}

/// Says how the scattered sound decays, and what of it has left the room.
fn decay(late: &LateField) {
    match late.mean_t30_s() {
        Some(t30) => {
            let error =
                late.t30_error.map_or(String::new(), |e| format!(", at one place off by {:.1} % for few rays", 100.0 * e));
            report::note(format_args!("T30 of the scattered sound: {} s{error}", times(t30)));
        }
        None => report::note("the scattered sound has no T30: it does not fall by 35 dB along a line within the responses"),
    }
    let escaped = late.escaped.iter().fold(0.0, |a: f32, b| a.max(*b));
    if escaped > 0.01 {
        report::note(format_args!("{:.0} % of the energy left through openings of the mesh", 100.0 * escaped));
    }
}

fn poses(args: &SimulateMeshArgs, run: &RunArgs, inside: &Inside<'_>) -> Result<Vec<Pose>> {
    if let Some(file) = &run.path {
        return walk(file, run.poses);
    }
    if let Some(spacing) = args.grid {
        return Ok(turned(&grid(inside, spacing, args.height)?, args.turns.unwrap_or(1) as usize));
    }
    if !args.at.is_empty() {
        return Ok(turned(&args.at, args.turns.unwrap_or(24) as usize));
    }
    Ok(random_inside(inside, run.poses.unwrap_or(100) as usize, run.seed)?)
}
