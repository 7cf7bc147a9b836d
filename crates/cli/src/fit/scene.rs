//! Scenes of fitted rooms.

use crate::args::FitArgs;
use crate::{hrtf, report, scene};
use anyhow::{Result, bail};
use promenade_acoustics::{Material, Materials, Room, Source};
use promenade_baker::geometry::{GeometryOptions, bake_geometry};
use promenade_baker::simulation::{Hrtf, scene_spacing_m};
use promenade_core::Scene;
use promenade_fit::{FullFit, MaterialsBeside, Measurements, full_mesh};
use std::path::Path;

/// Sample rate of a scene, hertz.
const SCENE_HZ: u32 = 48_000;
/// Images that are played, turns of the head that are stored, beams, and rays.
const IMAGES: usize = 60;
const HEAD_TURNS: usize = 6;
const BEAMS: usize = 8192;
const RAYS: usize = 32_768;
/// Height of the listener over the floor, and distance from surfaces, metres.
const HEIGHT_M: f32 = 1.5;
const MARGIN_M: f32 = 0.3;

fn head(args: &FitArgs, output: &Path) -> Result<Hrtf> {
    let Some(head) = &args.head else { bail!("{}: expected --head for a scene", output.display()) };
    hrtf::at(&hrtf::read(head)?, SCENE_HZ, head)
}

fn materials(groups: &[String], beside: &MaterialsBeside) -> Result<Vec<Material>> {
    let table = Materials::default();
    Ok(groups.iter().map(|name| table.material(&beside.materials[name])).collect::<Result<_, _>>()?)
}

fn recipe(args: &FitArgs, set: &Measurements) -> String {
    let head = args.head.as_deref().map(report::file_name).unwrap_or_default();
    format!("fit {} --head {head} --seed {}{}", set.title, args.seed, args.set.air)
}

pub(super) fn write(args: &FitArgs, output: &Path, fit: &FullFit, set: &Measurements, beside: &MaterialsBeside) -> Result<()> {
    let hrtf = head(args, output)?;
    let bytes = scene::write_kept(output, made(args, &hrtf, fit, set, beside)?, args.less)?;
    report::line(format_args!("{}: {} kB", output.display(), bytes.div_ceil(1000)));
    Ok(())
}

/// The room with the source as it was found.
fn made(args: &FitArgs, hrtf: &Hrtf, fit: &FullFit, set: &Measurements, beside: &MaterialsBeside) -> Result<Scene> {
    let mesh = full_mesh(fit)?;
    let room = Room::new(&mesh, &materials(&mesh.groups, beside)?)?;
    let (found, facing) = match (fit.places.first(), set.all.first()) {
        (Some(found), Some(m)) => (found.source_m, m.source.facing),
        _ => bail!("expected a measurement"),
    };
    let position = args.emitter.map_or(found, |e| e.as_dvec3().to_array());
    let [x, y, z] = facing.unwrap_or([1.0, 0.0, 0.0]);
    let directivity = fit.directivity()?.turned(y.atan2(x), z.atan2(x.hypot(y)));
    let options = GeometryOptions {
        images: IMAGES,
        head_turns: HEAD_TURNS,
        order: args.order,
        beams: BEAMS,
        rays: RAYS,
        spacing_m: scene_spacing_m(&mesh),
        height_m: HEIGHT_M,
        layered: false,
        margin_m: MARGIN_M,
        air: Some(set.air),
        waves_hz: None,
        gain_db: 0.0,
        seed: args.seed,
        title: format!("{}, fitted", set.title),
        recipe: recipe(args, set),
    };
    let bar = report::Bar::new("baking the scene", 1.0);
    let source = Source { position, directivity };
    Ok(bake_geometry(&mesh, &room, &source, hrtf, &options, |share| bar.at(share))?)
}
