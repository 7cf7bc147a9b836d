//! `promenade fit`: what measurements tell of a room, and how well it foretells others.

use crate::args::FitArgs;
use crate::{report, scene};
use anyhow::{Context, Result, bail};
use promenade_acoustics::{Material, Materials, Shoebox};
use promenade_audio::atomic;
use promenade_baker::geometry::scene_head;
use promenade_baker::simulation::Hrtf;
use promenade_baker::{LoadOptions, Responses};
use promenade_core::glam::{DVec3, Vec3};
use promenade_fit::{
    MaterialsBeside, Measurements, QuickFit, Row, Split, WALLS, Walls, absorption_svg, all_figures, baselines, box_obj, errors,
    json, markdown, mean_rows, quick_fit, quick_row, table,
};
use promenade_room::{PLAYED_IMAGES, SceneOptions, ShoeboxRoom};
use std::path::Path;
use std::time::Instant;

/// Sample rate of a scene, hertz.
const SCENE_HZ: u32 = 48_000;

pub(crate) fn run(args: &FitArgs) -> Result<()> {
    let (room, path) = match &args.of[..] {
        [room, path] => (Some(walls(room)?), path),
        [path, ..] => (None, path),
        [] => bail!("expected measurements"),
    };
    let set = Measurements::load(path, &args.set.options())?;
    report::notes(&set.notes);
    if args.evaluate {
        evaluate(args, room.as_ref(), &set)?;
    }
    if args.output.is_none() && args.changed.is_none() {
        return Ok(());
    }
    let Some(room) = room else { bail!("expected a room before the measurements: length, width and height, X,Y,Z") };
    let began = Instant::now();
    let fit = quick_fit(&room, &set, args.seed)?;
    report::line(format_args!("{}: fitted in {:.2} s", set.title, began.elapsed().as_secs_f64()));
    for hz in fit.missing_hz() {
        report::note(format_args!("the octave about {hz} Hz is not fitted: no response decays by 25 dB there"));
    }
    if let Some(output) = &args.output {
        write(args, output, &fit, &set)?;
    }
    if let Some(changed) = &args.changed {
        judge_changed(args, changed, &fit, &set)?;
    }
    Ok(())
}

fn walls(room: &Path) -> Result<Walls> {
    let text = room.to_string_lossy();
    let lengths: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match lengths.as_deref() {
        Ok([x, y, z]) => Ok(Walls::of_size([*x, *y, *z])?),
        _ => bail!("{text}: expected the room's length, width and height in metres, X,Y,Z"),
    }
}

fn evaluate(args: &FitArgs, room: Option<&Walls>, set: &Measurements) -> Result<()> {
    let convention = args.convention.into();
    let count = set.all.len();
    let places = args.places.unwrap_or(count.div_ceil(3));
    let figures = all_figures(set, convention);
    let mut tables: Vec<Vec<Row>> = Vec::new();
    for i in 0..u64::from(args.splits) {
        let split = Split::drawn(count, places, args.seed.wrapping_add(i))?;
        let mut rows = baselines(set, &figures, &split, convention);
        if let Some(walls) = room {
            rows.push(quick_row(walls, set, &figures, &split, convention, args.seed)?);
        }
        tables.push(rows);
    }
    report::line(format_args!(
        "{}: fitted to {places} of {count} places, judged at the others, {} draws, {} Hz, {}",
        set.title,
        args.splits,
        set.sample_rate_hz,
        convention.name()
    ));
    report::print(&report::table(&table(&mean_rows(&tables)), args.markdown))
}

fn judge_changed(args: &FitArgs, path: &Path, fit: &QuickFit, set: &Measurements) -> Result<()> {
    let mut options = args.set.options();
    options.setting.clone_from(&args.changed_setting);
    let changed = Measurements::load(path, &options)?;
    report::notes(&changed.notes);
    let convention = args.convention.into();
    let figures = all_figures(&changed, convention);
    let groups: Vec<String> = WALLS.iter().map(|w| (*w).to_owned()).collect();
    let mut other = fit.clone();
    for (wall, name) in WALLS.iter().enumerate() {
        let rules: Vec<(String, String)> = [&args.materials[..], &[("*".to_owned(), "0.5".to_owned())]].concat();
        let all = Materials::default().assign(&groups, &rules)?;
        let touched = args.materials.iter().any(|rule| {
            let one = [rule.clone(), ("*".to_owned(), "0".to_owned())];
            Materials::default().assign(&[(*name).to_owned()], &one[..1]).is_ok()
        });
        if touched {
            other = other.with_absorption(wall, &all[wall].absorption);
        }
    }
    let row =
        |name: &str, fit: &QuickFit| Row { name: name.to_owned(), errors: errors(fit, set, &changed, &figures, convention) };
    let rows = [row("unchanged", fit), row("changed", &other)];
    report::line(format_args!("{}: foretold of {}, {}", changed.title, set.title, convention.name()));
    report::print(&report::table(&table(&rows), args.markdown))
}

fn write(args: &FitArgs, output: &Path, fit: &QuickFit, set: &Measurements) -> Result<()> {
    let is_scene = output.extension().is_some_and(|e| e == "promenade");
    if !is_scene && output.extension().is_none_or(|e| e != "obj") {
        bail!("{}: expected a file ending in .obj or .promenade", output.display());
    }
    let made = format!("fit of {} to {} responses, promenade {}", set.title, set.all.len(), env!("CARGO_PKG_VERSION"));
    let beside = MaterialsBeside::of(fit, &made);
    let svg = output.with_extension("report.svg");
    let files = [
        (output.with_extension("obj"), box_obj(&fit.walls)),
        (output.with_extension("materials.json"), serde_json::to_string_pretty(&beside)? + "\n"),
        (output.with_extension("report.md"), markdown(fit, set, &report::file_name(&svg))),
        (output.with_extension("report.json"), serde_json::to_string_pretty(&json(fit, set))? + "\n"),
        (svg, absorption_svg(fit)),
    ];
    for (path, text) in &files {
        atomic::write(path, text.as_bytes())?;
        report::line(path.display());
    }
    if is_scene { write_scene(args, output, fit, set, &beside) } else { Ok(()) }
}

fn write_scene(args: &FitArgs, output: &Path, fit: &QuickFit, set: &Measurements, beside: &MaterialsBeside) -> Result<()> {
    let Some(head) = &args.head else { bail!("{}: expected --head for a scene", output.display()) };
    let responses = Responses::load(head, &LoadOptions::default())?;
    let hrtf = Hrtf::new(&responses, SCENE_HZ).with_context(|| format!("{}: makes no HRTF", head.display()))?;
    let table = Materials::default();
    let materials: Result<Vec<Material>, _> = WALLS.iter().map(|name| table.material(&beside.materials[*name])).collect();
    let Ok(materials) = materials?.try_into() else { bail!("expected six walls") };
    let source = set.all.first().map_or(Vec3::ZERO, |m| DVec3::from(m.source.at_m).as_vec3());
    let room = ShoeboxRoom {
        walls: Shoebox { size: fit.walls.size_m(), materials },
        corner: DVec3::from(fit.walls.low_m).as_vec3(),
        emitter: args.emitter.unwrap_or(source),
    };
    let options = SceneOptions {
        images: PLAYED_IMAGES,
        seed: args.seed,
        title: format!("{}, fitted", set.title),
        recipe: format!("fit {} --head {} --seed {}", set.title, report::file_name(head), args.seed),
    };
    let bytes = scene::write(output, &room.scene(&scene_head(&hrtf)?, &options)?)?;
    report::line(format_args!("{}: {} kB", output.display(), bytes.div_ceil(1000)));
    Ok(())
}
