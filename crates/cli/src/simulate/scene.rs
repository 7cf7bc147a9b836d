//! `promenade simulate ROOM -o SCENE.promenade` and `simulate box ... -o SCENE.promenade`: scenes of image sources.

use super::boxed::{after_eyring, walls};
use super::{RAYS, head_of};
use crate::args::{AirArgs, LessArgs, RoomArgs, RunArgs, SimulateBoxArgs, SimulateMeshArgs};
use crate::{report, scene};
use anyhow::{Result, bail};
use promenade_acoustics::{Mesh, Room, Source};
use promenade_baker::geometry::{GeometryOptions, bake_box, bake_geometry, scene_head};
use promenade_baker::simulation::scene_spacing_m;
use promenade_core::Scene;
use promenade_core::glam::Vec3;
use promenade_room::{PLAYED_IMAGES, SceneOptions, ShoeboxRoom};
use std::path::Path;
use std::time::Instant;

pub(super) fn write(
    mesh: &Mesh,
    room: &Room,
    source: &Source,
    of: &RoomArgs,
    args: &SimulateMeshArgs,
    (run, air, less): (&RunArgs, AirArgs, LessArgs),
) -> Result<()> {
    let began = Instant::now();
    let places = run.path.is_some() || !args.at.is_empty() || run.poses.is_some() || args.turns.is_some();
    if places || run.part.is_some() || !run.further.is_empty() {
        bail!(
            "{}: expected --grid alone for the places of a scene, found --at, --path, --poses, --turns, --part or --further",
            args.output.display()
        );
    }
    let (_, hrtf) = head_of(run, args.rate, [args.credit.as_ref(), args.licence.as_ref()])?;
    let spacing_m = args.grid.unwrap_or_else(|| scene_spacing_m(mesh));
    let options = GeometryOptions {
        images: args.images as usize,
        head_turns: args.head_turns as usize,
        order: args.order,
        beams: args.beams as usize,
        rays: args.rays.unwrap_or(RAYS) as usize,
        spacing_m,
        height_m: args.height,
        layered: false,
        margin_m: args.margin,
        air: Some(air.air()),
        waves_hz: run.waves,
        gain_db: run.gain,
        seed: run.seed,
        title: args.title.clone().unwrap_or_else(|| report::file_name(&of.mesh)),
        recipe: recipe(of, args, spacing_m, (run, air)),
    };
    let bar = report::Bar::new("simulating", 1.0);
    let baked = bake_geometry(mesh, room, source, &hrtf, &options, |share| bar.at(share))?;
    drop(bar);
    written(&args.output, baked, less, began)
}

/// Sample rate of a box's scene unless told, hertz.
const SCENE_HZ: u32 = 48_000;

pub(super) fn write_box(args: &SimulateBoxArgs) -> Result<()> {
    let began = Instant::now();
    let run = &args.run;
    if run.part.is_some()
        || run.path.is_some()
        || run.poses.is_some()
        || run.length.is_some()
        || !args.clips.dry.is_empty()
        || !run.further.is_empty()
    {
        bail!("{}: expected no --path, --poses, --length, --part, --further or --dry for a scene", args.output.display());
    }
    let rate = args.rate.unwrap_or(SCENE_HZ);
    let (_, hrtf) = head_of(run, rate, [None; 2])?;
    let walls = walls(args);
    let [x, y, z] = args.size.to_array();
    let names = walls.materials.each_ref().map(|material| material.name.as_str()).join(";");
    let [ex, ey, ez] = args.emitter.to_array();
    let options = SceneOptions {
        images: PLAYED_IMAGES,
        air: args.air.air(),
        waves_hz: run.waves,
        layer_m: None,
        gain_db: run.gain,
        seed: run.seed,
        title: args.title.clone().unwrap_or_else(|| format!("Room of {x} x {y} x {z} m")),
        recipe: format!(
            "simulate box --size {x},{y},{z} --emitter {ex},{ey},{ez} --materials '{names}' --rate {rate}{}",
            of_run(run, args.air)
        ),
    };
    let room = ShoeboxRoom { walls, corner: Vec3::ZERO, emitter: args.emitter };
    let bar = report::Bar::new("simulating", 1.0);
    let made = bake_box(&room, &scene_head(&hrtf)?, &options)?;
    drop(bar);
    after_eyring(&room.walls, args.air.air());
    written(&args.output, made, args.less, began)
}

/// Writes a scene and says what it is.
fn written(output: &Path, made: Scene, args: LessArgs, began: Instant) -> Result<()> {
    let notes = made.provenance().notes.join("; ");
    let bytes = scene::write_kept(output, made, args)?;
    report::line(format_args!(
        "{}: {} kB, {} in {:.1} s",
        output.display(),
        bytes.div_ceil(1000),
        notes,
        began.elapsed().as_secs_f64()
    ));
    Ok(())
}

/// The options that all scenes have. Every field is named, so that none is forgotten.
fn of_run(run: &RunArgs, air: AirArgs) -> String {
    let RunArgs { head, further: _, path: _, poses: _, length: _, waves, gain, seed, part: _ } = run;
    let waves = waves.map_or(String::new(), |hz| format!(" --waves {hz}"));
    let gain = if *gain == 0.0 { String::new() } else { format!(" --gain {gain}") };
    format!(" --head {} --seed {seed}{air}{waves}{gain}", report::file_name(head))
}

/// The command that makes the scene, without its folders. Every field of its arguments is named, so that none is forgotten.
fn recipe(of: &RoomArgs, args: &SimulateMeshArgs, spacing_m: f32, (run, air): (&RunArgs, AirArgs)) -> String {
    let RoomArgs { mesh, source, materials, material_table, scale, up, flatten, directivity, facing } = of;
    let SimulateMeshArgs { height, margin, images, head_turns, order, beams, rays, rate, .. } = args;
    let rays = rays.unwrap_or(RAYS);
    let SimulateMeshArgs { at: _, grid: _, turns: _, title: _, credit: _, licence: _, output: _, .. } = args;
    let [x, y, z] = source.to_array();
    let up = up.map_or(String::new(), |up| format!(" --up {},{},{}", up.x, up.y, up.z));
    let given = |name: &str, value: Option<f64>| value.map_or(String::new(), |value| format!(" --{name} {value}"));
    let materials: Vec<String> = materials.iter().map(|(pattern, material)| format!("{pattern}={material}")).collect();
    let materials = if materials.is_empty() { String::new() } else { format!(" --materials '{}'", materials.join(",")) };
    let tables: String = material_table.iter().map(|t| format!(" --material-table {}", report::file_name(t))).collect();
    let directivity = directivity.as_ref().map_or(String::new(), |d| format!(" --directivity {}", report::file_name(d)));
    let facing = facing.map_or(String::new(), |[yaw, pitch]| format!(" --facing {yaw},{pitch}"));
    format!(
        "simulate {} --emitter {x},{y},{z}{directivity}{facing}{materials}{tables}{}{up}{} --grid {spacing_m} \
         --height {height} --margin {margin} --order {order} --beams {beams} --images {images} \
         --head-turns {head_turns} --rays {rays} --rate {rate}{}",
        report::file_name(mesh),
        given("scale", *scale),
        given("flatten", *flatten),
        of_run(run, air)
    )
}
