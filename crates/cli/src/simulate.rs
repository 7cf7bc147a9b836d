//! `promenade simulate`: responses of rooms that nobody has measured.

#[cfg(feature = "train")]
pub(crate) mod places;
mod scene;

use crate::args::{
    AirArgs, ClipArgs, RoomArgs, RunArgs, Simulate, SimulateArgs, SimulateBoxArgs, SimulateMeshArgs, SizeScattering,
};
use crate::{capture, path, report};
use anyhow::{Context, Result, bail};
use promenade_acoustics::{
    Air, Directivity, Entry, Material, Materials, Mesh, MeshReport, Room, SPEED_OF_SOUND_M_S, Shoebox, Source,
};
use promenade_baker::simulation::{
    Hrtf, Inside, MeshOptions, Part, PartFolder, RunKey, Simulated, along, directivity, fit, grid, random_inside, random_poses,
    simulate_box, simulate_mesh, turned,
};
use promenade_baker::{LoadOptions, Responses};
use promenade_core::Pose;
use promenade_core::glam::Vec3;
use promenade_fit::MaterialsBeside;
use promenade_paths::ImportOptions;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Sample rate of a box's responses unless told, hertz.
const RESPONSES_HZ: u32 = 24_000;

pub(crate) fn run(args: &SimulateArgs) -> Result<()> {
    match (&args.what, &args.room, &args.mesh, &args.run) {
        (Some(Simulate::Box(args)), ..) => box_room(args),
        (Some(Simulate::Materials), ..) => materials(),
        (None, Some(room), Some(mesh), Some(run)) => mesh_room(room, mesh, run, args.air, &args.clips),
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

fn mesh_room(of: &RoomArgs, args: &SimulateMeshArgs, run: &RunArgs, air_args: AirArgs, clips: &ClipArgs) -> Result<()> {
    let began = Instant::now();
    let source = source(of)?;
    let (mesh, room, size) = room(of)?;
    let volume = size.volume_m3.unwrap_or_else(|| room.bounding_volume());
    let air = air_args.air();
    let eyring = room.eyring_t60_s(volume, Some(air));
    if args.output.extension().is_some_and(|e| e == "promenade") {
        if !clips.dry.is_empty() {
            bail!("{}: expected --dry for a capture, found a scene to write", args.output.display());
        }
        return scene::write(&mesh, &room, &source, of, args, (run, air_args));
    }
    let inside = Inside::new(&mesh, &room, of.source, args.margin)?;
    let poses = mesh_poses(args, run, &inside)?;
    for pose in poses.iter().filter(|_| size.volume_m3.is_some()) {
        within("listener", &room, &mesh, pose.position)?;
    }
    let (set, hrtf) = head(args, run)?;
    let options = MeshOptions {
        order: args.order,
        beams: args.beams as usize,
        rays: args.rays as usize,
        length_s: run.length,
        air: Some(air),
        waves_hz: run.waves,
        seed: run.seed,
        part: run.part.unwrap_or(Part::WHOLE),
    };
    let whole = MeshOptions { part: Part::WHOLE, ..options };
    let title = args.title.clone().unwrap_or_else(|| report::file_name(&of.mesh));
    let part =
        part_folder(run.part, &args.output, &poses, &[&title, &mesh, &room.materials(), &source, &set, &args.rate, &whole])?;
    if part.as_ref().is_some_and(is_there) {
        return Ok(());
    }
    let bar = report::Bar::new(1.0);
    let simulated = simulate_mesh(&mesh, &room, &source, &hrtf, &poses, &options, |share| bar.at(share))?;
    drop(bar);
    let Simulated { mut responses, late, images, crossover_hz } = simulated;
    responses.title = title;
    responses.notes.push(format!(
        "simulated by promenade {}: image sources up to order {} of {} beams, {} rays with seed {}, head {} of {} directions",
        env!("CARGO_PKG_VERSION"),
        args.order,
        args.beams,
        args.rays,
        run.seed,
        set.title,
        hrtf.directions()
    ));
    responses.notes.extend(crossover_hz.map(|hz| format!("below {hz:.0} Hz by waves")));
    let output = save(&responses, part.as_ref(), &args.output, &poses, (clips, run.seed))?;
    let frames = responses.responses.first().map_or(0, |r| r.left.len());
    let silent = responses.responses.iter().filter(|r| r.left.iter().chain(&r.right).all(|v| *v == 0.0)).count();
    if silent > 0 {
        report::note(format_args!(
            "nothing of the source arrives at {silent} of {} poses: their responses are silent",
            poses.len()
        ));
    }
    let time = |t: &f64| if t.is_finite() { format!("{t:.2}") } else { "no end".to_owned() };
    let times = |times: [f64; 7]| times.iter().map(time).collect::<Vec<_>>().join(", ");
    let enclosed = room.surroundings(source.position)?.enclosed;
    if enclosed < LEAST_ENCLOSED {
        report::note(format_args!(
            "{:.0} % of the directions from the source meet no surface: there is no reverberation time after Eyring",
            100.0 * (1.0 - enclosed)
        ));
    } else {
        let of = if size.volume_m3.is_some() { "" } else { " (of the box about the mesh, which is not closed)" };
        report::note(format_args!(
            "{volume:.1} m3{of}, {:.1} m2; after Eyring, octaves from 125 Hz to 8 kHz: {} s",
            size.area_m2,
            times(eyring)
        ));
    }
    match late.mean_t30_s() {
        Some(t30) => report::note(format_args!("T30 of the scattered sound: {} s", times(t30))),
        None => report::note("the scattered sound has no T30: it does not fall by 35 dB along a line within the responses"),
    }
    let escaped = late.escaped.iter().fold(0.0, |a: f32, b| a.max(*b));
    if escaped > 0.01 {
        report::note(format_args!("{:.0} % of the energy left through openings of the mesh", 100.0 * escaped));
    }
    report::line(format_args!(
        "{}: {} responses of {:.2} s at {} Hz from {images} images and {} rays in {:.1} s",
        output.display(),
        responses.responses.len(),
        frames as f64 / f64::from(args.rate),
        args.rate,
        args.rays,
        began.elapsed().as_secs_f64()
    ));
    Ok(())
}

/// The head's responses, and what is made of them.
fn head(args: &SimulateMeshArgs, run: &RunArgs) -> Result<(Responses, Hrtf)> {
    let mut set = Responses::load(&run.head, &LoadOptions::default())?;
    for (stated, text) in [(&args.credit, &mut set.credit), (&args.licence, &mut set.licence)] {
        if let Some(stated) = stated {
            text.clone_from(stated);
        }
    }
    let hrtf = Hrtf::new(&set, args.rate).with_context(|| format!("{}: makes no HRTF", run.head.display()))?;
    Ok((set, hrtf))
}

/// Share of the directions in which a room has a surface, at least.
const LEAST_ENCLOSED: f64 = 0.8;
/// Materials that differ, at most.
const MOST_MATERIALS: usize = 1000;
/// Nearer to a surface than this, metres, it is not asked on which side of it a place is.
const AT_SURFACE_M: f64 = 1e-3;
/// Distance from surfaces of a place that is proposed, metres.
const PROPOSED_M: f64 = 0.1;

/// The mesh with its materials, and what it is like; what is odd about it is said.
pub(crate) fn room(args: &RoomArgs) -> Result<(Mesh, Room, MeshReport)> {
    let mut mesh = Mesh::load(&args.mesh)?;
    mesh.scale(args.scale.unwrap_or(1.0));
    let size = mesh.report();
    if let (None, Some(odd)) = (args.scale, size.odd_size()) {
        bail!("{}: {odd}; --scale says what a unit is, and --scale 1 that it is the metre", args.mesh.display());
    }
    let mut notes = size.warnings();
    if let [only] = &mesh.groups[..]
        && !args.materials.iter().any(|(pattern, _)| pattern == only || pattern == "*")
    {
        notes.push(format!("all triangles are of {only:?}: they are sorted into floor, ceiling and wall by where they look"));
        mesh.group_by_direction();
    }
    if args.flatten != Some(0.0)
        && let Some(done) = mesh.flatten(args.flatten)
    {
        notes.push(done.to_string());
    }
    report::notes(&notes);
    let rules = [&args.materials[..], &fitted(&args.mesh)?].concat();
    let materials = table(&args.material_table)?.assign(&mesh.groups, &rules);
    let mut materials = materials.with_context(|| format!("{}: its materials cannot be found", args.mesh.display()))?;
    if args.scattering_by_size == SizeScattering::ChristensenRindel {
        let [x, y, z] = size.size_m;
        let free_path = 4.0 * size.volume_m3.unwrap_or(x * y * z) / size.area_m2.max(f64::MIN_POSITIVE);
        materials = mesh.scatter_by_size(&materials, free_path, SPEED_OF_SOUND_M_S);
    }
    let materials = mesh.merge_groups(materials);
    if materials.len() > MOST_MATERIALS {
        bail!("{}: expected at most {MOST_MATERIALS} materials that differ, found {}", args.mesh.display(), materials.len());
    }
    let room = Room::new(&mesh, &materials).with_context(|| format!("{}: makes no room", args.mesh.display()))?;
    if size.volume_m3.is_some() {
        within("--source", &room, &mesh, args.source)?;
    }
    Ok((mesh, room, size))
}

/// The built-in table with those of files before it.
fn table(files: &[PathBuf]) -> Result<Materials> {
    let mut table = Materials::default();
    for file in files {
        let mut all = vec![file.clone()];
        if file.is_dir() {
            let entries = std::fs::read_dir(file).with_context(|| format!("{}: cannot be read", file.display()))?;
            let entries = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>()?;
            all = entries.into_iter().filter(|path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))).collect();
            // Which of two of the same name holds does not depend on the folder's order.
            all.sort();
        }
        let counts = all.iter().map(|path| table.add_table(path)).collect::<Result<Vec<usize>, _>>()?;
        let count = counts.into_iter().sum::<usize>();
        if count == 0 {
            bail!("{}: expected tables that end in .csv, found none", file.display());
        }
        report::note(format_args!("{count} materials of {}", report::file_name(file)));
    }
    Ok(table)
}

/// Refuses a place outside of a closed room, where nothing is heard of what is inside.
fn within(what: &str, room: &Room, mesh: &Mesh, at: Vec3) -> Result<()> {
    let place = at.as_dvec3().to_array();
    if room.encloses(place)? || room.surroundings(place)?.clearance_m < AT_SURFACE_M {
        return Ok(());
    }
    let written = |[x, y, z]: [f64; 3]| format!("{x:.2},{y:.2},{z:.2}");
    let [low, high] = mesh.bounds().map(written);
    let nearest = match room.nearest_inside(place, PROPOSED_M)? {
        Some(near) => format!("; the nearest place inside is {}", written(near)),
        None => String::new(),
    };
    bail!("{what}: expected a place in the closed room, which lies from {low} to {high} m, found {}{nearest}", written(place));
}

/// Materials that a fit has left in a file beside the mesh, as rules that come after those of the command line.
fn fitted(mesh: &Path) -> Result<Vec<(String, String)>> {
    let beside = mesh.with_extension("materials.json");
    if !beside.is_file() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(&beside).with_context(|| format!("{}: cannot be read", beside.display()))?;
    let found: MaterialsBeside =
        serde_json::from_str(&text).with_context(|| format!("{}: expected materials by group", beside.display()))?;
    report::note(format_args!("materials of {} where no rule says otherwise", report::file_name(&beside)));
    Ok(found.materials.into_iter().collect())
}

/// The source: where it is, and what it sends where.
pub(crate) fn source(args: &RoomArgs) -> Result<Source> {
    let directivity = match args.directivity.to_str().and_then(Directivity::named) {
        Some(named) => named,
        None if args.directivity.extension().is_some_and(|e| e.eq_ignore_ascii_case("sofa")) => directivity(&args.directivity)?,
        None => {
            let names = Directivity::PATTERNS.map(|(name, _)| name).join(", ");
            bail!("--directivity: expected {names} or a .sofa file, found {}", args.directivity.display());
        }
    };
    let [yaw, pitch] = args.facing.map(f64::to_radians);
    Ok(Source { position: args.source.as_dvec3().to_array(), directivity: directivity.turned(yaw, pitch) })
}

fn mesh_poses(args: &SimulateMeshArgs, run: &RunArgs, inside: &Inside<'_>) -> Result<Vec<Pose>> {
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

/// The folder of a part of the run that all of this decides.
fn part_folder(part: Option<Part>, among: &Path, poses: &[Pose], run: &[&dyn Debug]) -> Result<Option<PartFolder>> {
    let Some(part) = part else { return Ok(None) };
    if part.poses(poses).is_empty() {
        bail!("--part: expected at most as many parts as places of the listener, found {} of {}", part.number, part.of);
    }
    Ok(Some(PartFolder::new(among, RunKey::of(&[&poses, &run]), part)))
}

/// Whether a part need not be made, which is said.
fn is_there(part: &PartFolder) -> bool {
    let there = part.is_complete();
    if there {
        report::line(format_args!("{}: is there already", part.path().display()));
    }
    there
}

/// Writes a set, a part of it, or what it makes of dry sound, and tells where.
fn save<'a>(
    responses: &Responses,
    part: Option<&'a PartFolder>,
    output: &'a Path,
    poses: &[Pose],
    (clips, seed): (&ClipArgs, u64),
) -> Result<&'a Path> {
    match part {
        Some(part) => part.save(responses, poses)?,
        None if !clips.dry.is_empty() => capture::write(&capture::clips_of(responses, clips, None, seed)?, output)?,
        None => responses.save(output)?,
    }
    Ok(part.map_or(output, PartFolder::path))
}

fn box_room(args: &SimulateBoxArgs) -> Result<()> {
    if args.output.extension().is_some_and(|e| e == "promenade") {
        return scene::write_box(args);
    }
    let walls = walls(args);
    let rate = args.rate.unwrap_or(RESPONSES_HZ);
    let poses = poses(args)?;
    let set = Responses::load(&args.run.head, &LoadOptions::default())?;
    let hrtf = Hrtf::new(&set, rate).with_context(|| format!("{}: makes no HRTF", args.run.head.display()))?;
    let options = MeshOptions {
        order: args.order,
        beams: 0,
        rays: args.rays as usize,
        length_s: args.run.length,
        air: Some(args.air.air()),
        waves_hz: args.run.waves,
        seed: args.run.seed,
        part: args.run.part.unwrap_or(Part::WHOLE),
    };
    let run = MeshOptions { part: Part::WHOLE, ..options };
    let part = part_folder(args.run.part, &args.output, &poses, &[&walls, &args.emitter, &set, &rate, &run])?;
    if part.as_ref().is_some_and(is_there) {
        return Ok(());
    }
    let bar = report::Bar::new(1.0);
    let done = |share| bar.at(share);
    let Simulated { mut responses, images, .. } = simulate_box(&walls, args.emitter, &hrtf, &poses, &options, done)?;
    drop(bar);
    responses.notes.push(format!(
        "simulated by promenade {}: image sources up to order {}, {} rays with seed {}, head {} of {} directions",
        env!("CARGO_PKG_VERSION"),
        args.order,
        args.rays,
        args.run.seed,
        set.title,
        hrtf.directions()
    ));
    let output = save(&responses, part.as_ref(), &args.output, &poses, (&args.clips, args.run.seed))?;
    let frames = responses.responses.first().map_or(0, |r| r.left.len());
    after_eyring(&walls, args.air.air());
    report::line(format_args!(
        "{}: {} responses of {:.2} s at {} Hz from {images} images and {} rays",
        output.display(),
        responses.responses.len(),
        frames as f64 / f64::from(rate),
        rate,
        args.rays
    ));
    Ok(())
}

/// The box, with what is known of its walls.
fn walls(args: &SimulateBoxArgs) -> Shoebox {
    let materials = args.materials.clone().unwrap_or_else(|| args.absorption.map(Material::absorbing));
    Shoebox { size: args.size.as_dvec3().to_array(), materials }
}

/// Says how long a box rings.
fn after_eyring(walls: &Shoebox, air: Air) {
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

/// The poses of a walk: so many evenly over its time, or its keyframes.
fn walk(file: &Path, count: Option<u32>) -> Result<Vec<Pose>> {
    let walk = path::read(file, &ImportOptions::default())?;
    report::notes(&walk.notes);
    Ok(match count {
        Some(count) => along(&walk.path, count as usize),
        None => walk.path.keyframes().iter().map(|k| k.pose).collect(),
    })
}
