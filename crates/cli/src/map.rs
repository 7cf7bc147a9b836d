//! `promenade map`: what a room sounds like over its plan, the sound that falls on what a camera sees, how a mix stands out
//! over time, what a renderer of pictures may spend where, and how visibly its pictures differ.

mod camera;
mod composite;
mod exr;
mod mix;
mod saliency;
mod visibility;

use crate::args::{Map, MapArgs, RoomArgs};
use crate::plot::{self, Panel, Plan};
use crate::{report, simulate};
use anyhow::{Result, bail};
use promenade_acoustics::{Echogram, ImageOptions, Images, Measures, Mesh, RayOptions, Reflected, Room, Source, late_field};
use promenade_baker::atomic;
use promenade_baker::simulation::{Inside, grid};
use promenade_core::glam::Vec3;
use promenade_metrics::statistics::quantile;
use std::path::Path;

/// Places along the longer side of a plan, unless told.
const PLACES: f64 = 40.0;
/// Rays, unless told.
const RAYS: u32 = 65_536;
/// Length of a bin of the echograms, seconds.
const BIN_S: f64 = 0.004;
/// Largest echograms of all places together, bins.
const MOST_BINS: f64 = 1e6;

/// How to take a measure.
type Take = fn(&Measures) -> Option<f64>;
const MEASURES: [(&str, &str, Take); 4] = [
    ("Level, dB re direct sound at 1 m", "level, dB", |m| m.level_db),
    ("T20, s", "T20, s", |m| m.t20_s),
    ("C50, dB", "C50, dB", |m| m.c50_db),
    ("STI", "STI", |m| m.sti),
];

pub(crate) fn run(args: &MapArgs) -> Result<()> {
    match (&args.what, &args.room) {
        (Some(Map::Saliency(args)), _) => saliency::run(args),
        (Some(Map::Mix(args)), _) => mix::run(args),
        (Some(Map::Composite(args)), _) => composite::run(args),
        (Some(Map::Visibility(args)), _) => visibility::run(args),
        (None, Some(of)) => room(args, of),
        _ => bail!("expected a mesh of a room, `saliency`, `mix`, `composite` or `visibility`"),
    }
}

fn room(args: &MapArgs, of: &RoomArgs) -> Result<()> {
    let endings: &[&str] = if args.camera.is_some() { &["png", "exr"] } else { &["png", "svg", "exr"] };
    if let Some(other) = args.output.iter().find(|path| !endings.contains(&ending(path).as_str())) {
        bail!("{}: expected a file ending in .{}", other.display(), endings.join(" or ."));
    }
    let (mesh, room, _) = simulate::room(of)?;
    if let Some(camera) = &args.camera {
        return camera::run(args, &room, simulate::source(of)?, camera);
    }
    let (low, high) = plan_bounds(&mesh);
    let spacing = args.grid.unwrap_or(((high[0] - low[0]).max(high[1] - low[1]) / PLACES) as f32);
    let inside = Inside::new(&mesh, &room, of.source, args.margin)?;
    let places = grid(&inside, spacing, args.height)?;
    if places.len() as f64 * args.trace.length / BIN_S > MOST_BINS {
        bail!(
            "--grid: expected at most {} places of {} s, found {}",
            (MOST_BINS * BIN_S / args.trace.length) as u32,
            args.trace.length,
            places.len()
        );
    }
    let source = simulate::source(of)?;
    let measured = measured(args, &room, &source, &places)?;
    if measured.iter().all(|m| m.t20_s.is_none()) {
        report::note(format_args!(
            "T20 has no value: at no place the sound falls by 25 dB along a line within {} s; it is drawn grey",
            args.trace.length
        ));
    }
    let plan = Plan {
        spacing_m: f64::from(spacing),
        outline: mesh.section(mesh.bounds()[0][2] + f64::from(args.height)),
        bounds: [low, high],
        source: [source.position[0], source.position[1]],
    };
    let panels = MEASURES.map(|(title, _, take)| Panel { title: title.to_owned(), values: over(&places, &measured, take) });
    for path in &args.output {
        match ending(path).as_str() {
            "svg" => atomic::write(path, plot::plan_svg(&plan, &panels)?.as_bytes())?,
            "exr" => numbers(path, &places, spacing, &measured)?,
            _ => atomic::write(path, &plot::plan_png(&plan, &panels)?)?,
        }
    }
    let mut rows = vec![["", "least", "median", "most", "places"].map(str::to_owned).to_vec()];
    rows.extend(MEASURES.iter().map(|(_, name, take)| row(name, &measured, *take)));
    report::print(&report::table(&rows, false))
}

/// The measures at places of the listener.
fn measured(args: &MapArgs, room: &Room, source: &Source, places: &[Vec3]) -> Result<Vec<Measures>> {
    let listeners: Vec<[f64; 3]> = places.iter().map(|p| p.as_dvec3().to_array()).collect();
    let air = Some(args.trace.air.air());
    let images = ImageOptions { order: args.order, beams: args.beams as usize, ..ImageOptions::default() };
    let images = Images::new(room, source, &images)?;
    let rays = args.trace.options(args.rays.unwrap_or(RAYS));
    let rays = RayOptions { bin_s: BIN_S, images: Some(&images), ..rays };
    let bar = report::Bar::new("tracing", 1.0);
    let late = late_field(room, source, &listeners, &rays, |share| bar.at(share))?;
    drop(bar);
    let measures = |(at, echogram): (&[f64; 3], &Echogram)| -> Result<Measures> {
        Ok(Measures::new(*at, &images.seen_from(room, *at, Reflected::Specular)?, echogram, air))
    };
    listeners.iter().zip(&late.echograms).map(measures).collect()
}

/// Least and greatest coordinates of a plan, with a margin about the room.
fn plan_bounds(mesh: &Mesh) -> ([f64; 2], [f64; 2]) {
    let [low, high] = mesh.bounds();
    let margin = 0.03 * (high[0] - low[0]).max(high[1] - low[1]);
    ([0, 1].map(|axis| low[axis] - margin), [0, 1].map(|axis| high[axis] + margin))
}

/// Writes a pixel for each place, and NaN where there is none: the row of the greatest y above, the least x on the left.
fn numbers(path: &Path, places: &[Vec3], spacing: f32, measured: &[Measures]) -> Result<()> {
    let low = places.iter().fold(Vec3::MAX, |low, place| low.min(*place));
    let index = |place: &Vec3| {
        let steps = ((*place - low) / spacing).round();
        [steps.x as usize, steps.y as usize]
    };
    let [width, height] = places.iter().map(index).fold([1, 1], |[w, h], [x, y]| [w.max(x + 1), h.max(y + 1)]);
    let channel = |take: Take| {
        let mut pixels = vec![f32::NAN; width * height];
        for (place, measures) in places.iter().zip(measured) {
            let [x, y] = index(place);
            pixels[(height - 1 - y) * width + x] = take(measures).map_or(f32::NAN, |value| value as f32);
        }
        pixels
    };
    exr::write(path, [width, height], MEASURES.iter().map(|(_, name, take)| (*name, channel(*take))).collect())
}

fn over(places: &[Vec3], measured: &[Measures], take: Take) -> Vec<([f64; 2], Option<f64>)> {
    let at = |place: &Vec3| [f64::from(place.x), f64::from(place.y)];
    places.iter().map(at).zip(measured.iter().map(take)).collect()
}

fn row(name: &str, measured: &[Measures], take: Take) -> Vec<String> {
    let mut values: Vec<f64> = measured.iter().filter_map(take).collect();
    values.sort_by(f64::total_cmp);
    let of = |share: f64| quantile(&values, share).map_or("none".to_owned(), |v| format!("{v:.2}"));
    let three = [0.0, 0.5, 1.0].map(of);
    let count = format!("{} of {}", values.len(), measured.len());
    [name.to_owned()].into_iter().chain(three).chain([count]).collect()
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
