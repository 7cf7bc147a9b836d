//! `promenade simulate`: responses of rooms that nobody has measured.

mod boxed;
pub(crate) mod join;
mod mesh;
#[cfg(feature = "train")]
pub(crate) mod places;
mod room;
mod scene;

pub(crate) use self::room::{described, mesh, room, source};

use crate::args::{ClipArgs, RunArgs, Simulate, SimulateArgs};
use crate::{capture, hrtf, path, report};
use anyhow::{Result, bail};
use promenade_acoustics::{Air, Entry, Materials};
use promenade_baker::simulation::{Hrtf, MeshOptions, Part, Simulated, along, is_complete, part_folder};
use promenade_baker::{Response, Responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_paths::ImportOptions;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(crate) fn run(args: &SimulateArgs) -> Result<()> {
    match (&args.what, &args.room, &args.mesh, &args.run) {
        (Some(Simulate::Box(args)), ..) if args.output.extension().is_some_and(|ending| ending == "promenade") => {
            scene::write_box(args)
        }
        (Some(Simulate::Box(args)), ..) => boxed::run(args),
        (Some(Simulate::Materials), ..) => materials(),
        (None, Some(room), Some(mesh), Some(run)) => mesh::run(room, mesh, run, args),
        _ => bail!("expected a mesh of a room, `box` or `materials`"),
    }
}

fn materials() -> Result<()> {
    let table = Materials::default();
    let absorbing = table.absorbing().map(|entry| ("absorbs", entry));
    let rows = absorbing.chain(table.scattering().map(|entry| ("scatters", entry)));
    let row = |(does, (name, entry)): (&str, (&str, &Entry))| {
        let shares: Vec<String> = entry.shares.iter().map(|s| format!("{s:.2}")).collect();
        format!("{name:<32}{does:<10}{}  {}\n", shares.join(" "), entry.description)
    };
    report::print(&rows.map(row).collect::<String>())
}

/// Rays of the late field unless told, at least.
const RAYS: u32 = 32_768;
/// How far T30 may then be off for lack of rays, as a share of it: what is just noticeable (ISO 3382-1).
const T30_WITHIN: f64 = 0.05;

/// How responses of a room are made, and where they go.
struct Run<'a> {
    began: Instant,
    args: &'a RunArgs,
    clips: &'a ClipArgs,
    output: &'a Path,
    order: u32,
    /// Beams that search the image sources; 0 where they are known without.
    beams: u32,
    rays: Option<u32>,
    rate: u32,
    air: Air,
    /// The head's responses, and what is made of them.
    head: (Responses, Hrtf),
}

/// A head's responses, with the credit and the licence that are stated for them, and what is made of them at a rate.
fn head_of(run: &RunArgs, rate: u32, [credit, licence]: [Option<&String>; 2]) -> Result<(Responses, Hrtf)> {
    let mut set = hrtf::read(&run.head)?;
    for (stated, text) in [(credit, &mut set.credit), (licence, &mut set.licence)] {
        if let Some(stated) = stated {
            text.clone_from(stated);
        }
    }
    let hrtf = hrtf::at(&set, rate, &run.head)?;
    Ok((set, hrtf))
}

impl Run<'_> {
    /// Refuses what only scenes have.
    fn check(&self) -> Result<()> {
        if self.args.gain != 0.0 {
            bail!("{}: expected --gain for a scene, found responses to write", self.output.display());
        }
        Ok(())
    }

    fn options(&self) -> MeshOptions {
        MeshOptions {
            order: self.order,
            beams: self.beams as usize,
            rays: self.rays.unwrap_or(RAYS) as usize,
            t30_within: self.rays.is_none().then_some(T30_WITHIN),
            length_s: self.args.length,
            air: Some(self.air),
            waves_hz: self.args.waves,
            seed: self.args.seed,
            part: self.args.part.unwrap_or(Part::WHOLE),
        }
    }

    /// The folder of a part of the run, which all of this decides beside the run itself.
    fn part_folder(&self, poses: &[Pose], room: &[&dyn Debug]) -> Result<Option<PathBuf>> {
        let Some(part) = self.args.part else { return Ok(None) };
        if part.poses(poses).is_empty() {
            bail!("--part: expected at most as many parts as places of the listener, found {} of {}", part.number, part.of);
        }
        let whole = MeshOptions { part: Part::WHOLE, ..self.options() };
        let run: [&dyn Debug; 3] = [&self.head.0, &self.rate, &whole];
        Ok(Some(part_folder(self.output, part, &[&poses, &[room, &run].concat()])))
    }

    /// How responses were made, for the notes of their set.
    fn note(&self, rays: usize) -> String {
        let beams = if self.beams > 0 { format!(" of {} beams", self.beams) } else { String::new() };
        format!(
            "simulated by promenade {}: image sources up to order {}{beams}, {} rays with seed {}, head {} of {} directions",
            env!("CARGO_PKG_VERSION"),
            self.order,
            rays,
            self.args.seed,
            self.head.0.title,
            self.head.1.directions()
        )
    }

    /// What an emitter and those of `--further` give, one set: all as long as the longest, named after their emitter's number
    /// where there are several.
    fn of_each(&self, first: Vec3, each: impl Fn(Vec3, f64) -> Result<Simulated>) -> Result<Simulated> {
        let count = (1 + self.args.further.len()) as f64;
        let mut all = each(first, 0.0)?;
        for (number, at) in self.args.further.iter().enumerate() {
            let rename =
                |set: &mut Responses, number| set.responses.iter_mut().for_each(|r| r.name = format!("{number}-{}", r.name));
            if number == 0 {
                rename(&mut all.responses, 1);
            }
            let mut more = each(*at, (number + 1) as f64 / count)?;
            rename(&mut more.responses, number + 2);
            all.responses.responses.append(&mut more.responses.responses);
            all.images += more.images;
        }
        let ears = |r: &Response| r.left.len();
        let longest = all.responses.responses.iter().map(ears).max().unwrap_or(0);
        let pad = |r: &mut Response| [&mut r.left, &mut r.right].into_iter().for_each(|ear| ear.resize(longest, 0.0));
        all.responses.responses.iter_mut().for_each(pad);
        Ok(all)
    }

    /// Writes a set, a part of it in its folder, or what it makes of dry sound. Returns where.
    fn save<'a>(&'a self, responses: &Responses, part: Option<&'a Path>) -> Result<&'a Path> {
        let output = part.unwrap_or(self.output);
        if self.clips.dry.is_empty() {
            responses.save(output)?;
        } else {
            capture::write(&capture::clips_of(responses, self.clips, None, self.args.seed)?, output)?;
        }
        Ok(output)
    }

    /// Says what was made.
    fn report(&self, output: &Path, responses: &Responses, (images, rays): (usize, usize)) {
        let frames = responses.responses.first().map_or(0, |r| r.left.len());
        report::line(format_args!(
            "{}: {} responses of {:.2} s at {} Hz from {images} images and {rays} rays in {:.1} s",
            output.display(),
            responses.responses.len(),
            frames as f64 / f64::from(self.rate),
            self.rate,
            self.began.elapsed().as_secs_f64()
        ));
    }
}

/// Whether a part need not be made, which is said.
fn is_there(part: &Path) -> bool {
    let there = is_complete(part);
    if there {
        report::line(format_args!("{}: is there already", part.display()));
    }
    there
}

/// The poses of a walk: so many evenly over its time, or its keyframes.
fn walk(file: &Path, count: Option<u32>) -> Result<Vec<Pose>> {
    let walk = path::read(file, &ImportOptions::default())?;
    report::notes(&walk.notes);
    Ok(match count {
        Some(count) => along(&walk.path, count as usize),
        None => walk.path.keyframes().iter().map(|k| k.pose).collect(),
    })
}
