//! `promenade simulate ROOM -o SCENE.promenade`: a scene of image sources.

use crate::args::{RoomArgs, RunArgs, SimulateMeshArgs};
use crate::{progress, report, scene};
use anyhow::{Result, bail};
use promenade_acoustics::{Air, Mesh, Room};
use promenade_baker::geometry::{GeometryOptions, bake_geometry};
use std::time::Instant;

/// Places of the listener that a scene has about, unless told.
const PLACES: f32 = 60.0;
/// The finest and widest spacing of places by itself, metres.
const SPACING_M: (f32, f32) = (0.5, 5.0);

pub(super) fn write(mesh: &Mesh, room: &Room, of: &RoomArgs, args: &SimulateMeshArgs, run: &RunArgs) -> Result<()> {
    let began = Instant::now();
    let places = run.path.is_some() || !args.at.is_empty() || run.poses.is_some() || args.turns.is_some();
    if places || run.part.is_some() {
        bail!(
            "{}: expected --grid alone for the places of a scene, found --at, --path, --poses, --turns or --part",
            args.output.display()
        );
    }
    let (_, hrtf) = super::head(args, run)?;
    let [low, high] = mesh.bounds();
    let area = ((high[0] - low[0]) * (high[1] - low[1])) as f32;
    let options = GeometryOptions {
        images: args.images as usize,
        order: args.order,
        beams: args.beams as usize,
        rays: args.rays as usize,
        spacing_m: args.grid.unwrap_or_else(|| (area / PLACES).sqrt().clamp(SPACING_M.0, SPACING_M.1)),
        height_m: args.height,
        margin_m: args.margin,
        air: Some(Air::default()),
        seed: run.seed,
        title: args.title.clone().unwrap_or_else(|| report::file_name(&of.mesh)),
        recipe: recipe(of, args, run),
    };
    let bar = progress::of_work();
    let baked = bake_geometry(mesh, room, of.source, &hrtf, &options, |share| bar.at(progress::SHARES * share))?;
    drop(bar);
    let bytes = scene::write(&args.output, &baked)?;
    report::line(format_args!(
        "{}: {} kB, {} in {:.1} s",
        args.output.display(),
        bytes.div_ceil(1000),
        baked.provenance().notes.join("; "),
        began.elapsed().as_secs_f64()
    ));
    Ok(())
}

/// The command that makes the scene, without its folders.
fn recipe(of: &RoomArgs, args: &SimulateMeshArgs, run: &RunArgs) -> String {
    let [x, y, z] = of.source.to_array();
    let materials: Vec<String> = of.materials.iter().map(|(pattern, material)| format!("{pattern}={material}")).collect();
    format!(
        "simulate {} --source {x},{y},{z} --materials '{}' --head {} --order {} --images {} --rays {} --rate {} --seed {}",
        report::file_name(&of.mesh),
        materials.join(","),
        report::file_name(&run.head),
        args.order,
        args.images,
        args.rays,
        args.rate,
        run.seed
    )
}
