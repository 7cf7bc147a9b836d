//! What fits and baselines predict, as tables.

use super::fitter::Fitter;
use super::room::Stated;
use crate::args::FitArgs;
use crate::report;
use anyhow::{Context, Result};
use promenade_acoustics::{Material, Materials};
use promenade_fit::{
    Alike, FITTED_HZ, FullFit, Measurements, RoomModel, Row, Split, all_figures, baselines, fit_row, mean_rows, octave_t20_s,
    prediction_errors, table,
};
use std::path::Path;

/// Draws of the places that are fitted to.
const DRAWS: u64 = 3;

/// Judges what is predicted at places that are held out.
pub(super) fn held_out(fitter: &Fitter<'_>, room: Option<&Stated>, set: &Measurements) -> Result<()> {
    let args = fitter.args;
    let count = set.all.len();
    let places = count.div_ceil(3);
    let figures = all_figures(set);
    let mut tables: Vec<Vec<Row>> = Vec::new();
    let bar = report::Bar::new("fitting", 1.0);
    for i in 0..DRAWS {
        let split = Split::drawn(count, places, args.seed.wrapping_add(i))?;
        let mut rows = baselines(set, &figures, &split);
        let row = |name: &str, fit: &dyn RoomModel| fit_row(name, fit, set, &figures, &split);
        if let Some(stated) = room {
            // One that is searched is searched in the places that are fitted to.
            let train = set.only(&split.train);
            let room = &stated.room(&train)?;
            let each = &mut |share| bar.at((i as f64 + share) / DRAWS as f64);
            let (whole, patches) = fitter.full(room, &train, each)?;
            rows.push(row("full fit", &whole));
            rows.extend(patches.map(|patches| row("full fit in voxels", &patches)));
        }
        tables.push(rows);
    }
    drop(bar);
    report::line(format_args!(
        "{}: fitted to {places} of {count} places, judged at the others, {DRAWS} draws, {} Hz, figures of AV-DAR",
        set.title, set.sample_rate_hz
    ));
    report::markdown_or(&args.markdown, |markdown| report::table(&table(&mean_rows(&tables)), markdown))
}

/// Judges a fitted room with other materials on measurements of the changed room.
pub(super) fn changed(args: &FitArgs, path: &Path, fit: &mut FullFit, set: &Measurements) -> Result<()> {
    let mut options = args.set.options();
    options.setting.clone_from(&args.changed_setting);
    let judge = Measurements::load(path, &options)?;
    report::notes(&judge.notes);
    if !args.alike.is_empty() {
        return alike(args, fit, set, &judge);
    }
    let figures = all_figures(&judge);
    let row =
        |name: &str, fit: &dyn RoomModel| Row { name: name.to_owned(), errors: prediction_errors(fit, set, &judge, &figures) };
    let unchanged = row("unchanged", fit);
    for (surface, material) in materials(&fit.room.surfaces, &args.materials)? {
        fit.set_absorption(surface, &material.absorption);
    }
    let rows = [unchanged, row("changed", fit)];
    report::line(format_args!("{}: predicted from {}, figures of AV-DAR", judge.title, set.title));
    report::markdown_or(&args.markdown, |markdown| report::table(&table(&rows), markdown))
}

/// What surfaces absorb that were changed together.
fn alike(args: &FitArgs, fit: &FullFit, before: &Measurements, after: &Measurements) -> Result<()> {
    let number = |name: &String| {
        let names = &fit.room.surfaces;
        names
            .iter()
            .position(|s| s == name)
            .with_context(|| format!("--alike: expected some of {}, found {name}", names.join(", ")))
    };
    let surfaces: Vec<usize> = args.alike.iter().map(number).collect::<Result<_>>()?;
    let found = Alike::of(fit, &surfaces, before, after);
    let (first, second) = (octave_t20_s(before), octave_t20_s(after));
    // From 125 Hz on, as materials have it.
    let octaves = 1..first.len();
    let row = |name: &str, of: &dyn Fn(usize) -> String| -> Vec<String> {
        std::iter::once(name.to_owned()).chain(octaves.clone().map(of)).collect()
    };
    let share = |a: Option<f64>| a.map_or("-".to_owned(), |a| format!("{a:.3}"));
    let rows = [
        row("octave, Hz", &|o| format!("{}", FITTED_HZ[o])),
        row("T20 before, s", &|o| format!("{:.3}", first[o])),
        row("T20 after, s", &|o| format!("{:.3}", second[o])),
        row("absorption before", &|o| share(found.before[o])),
        row("absorption after", &|o| share(found.after[o])),
    ];
    report::markdown_or(&args.markdown, |markdown| report::table(&rows, markdown))?;
    for (name, all) in [("before", &found.before), ("after", &found.after)] {
        // An octave that is not known is as the nearest that is.
        let known: Vec<(usize, f64)> = all.iter().enumerate().skip(1).filter_map(|(o, a)| Some((o, (*a)?))).collect();
        let nearest = |o: usize| known.iter().min_by_key(|k| k.0.abs_diff(o)).map_or(0.0, |k| k.1);
        let octaves: Vec<String> = (1..=7).map(|o| format!("{:.3}", nearest(o))).collect();
        let rules: Vec<String> = args.alike.iter().map(|surface| format!("{surface}={}", octaves.join("/"))).collect();
        report::line(format_args!("{name}: --materials '{}'", rules.join(",")));
    }
    Ok(())
}

/// The surfaces that rules name, with what they are made of then.
fn materials(surfaces: &[String], rules: &[(String, String)]) -> Result<Vec<(usize, Material)>> {
    // What no rule names is of a material that is not taken.
    let all: Vec<(String, String)> = [rules, &[("*".to_owned(), "0.5".to_owned())]].concat();
    let materials = Materials::default().assign(surfaces, &all)?;
    let named = |surface: &str| {
        rules.iter().any(|rule| Materials::default().assign(&[surface.to_owned()], std::slice::from_ref(rule)).is_ok())
    };
    Ok(materials.into_iter().enumerate().filter(|(s, _)| named(&surfaces[*s])).collect())
}
