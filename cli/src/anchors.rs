//! `promenade anchors`: the surfaces of a place become the anchors of a model.

use crate::args::AnchorsArgs;
use crate::report;
use anyhow::{Context, Result, anyhow, bail};
use promenade_baker::anchors::{AnchorOptions, AnchorSet, WALL_COLOURS, box_points};
use promenade_baker::reconstruction::{Place, Point, PointOptions, Reconstruction};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;
use std::path::Path;

pub(crate) fn run(args: &AnchorsArgs) -> Result<()> {
    let options = AnchorOptions { count: args.count, neighbours: args.neighbours, voxel_m: args.voxel, seed: args.seed };
    let mut notes = Vec::new();
    let (points, placement, what) = match (&args.source, args.size) {
        (Some(source), _) => of_file(source, args, &mut notes)?,
        (None, Some(size)) => {
            if args.placement.options() != PlacementOptions::default() || args.distance.is_some() {
                bail!("expected a file for the options of its placement, found a box, which is in metres and upright");
            }
            (box_points(size, args.voxel, &WALL_COLOURS)?, Placement::IDENTITY, "a box".to_owned())
        }
        (None, None) => bail!("expected a file or --box, found neither"),
    };
    let (set, made) =
        AnchorSet::from_points(&points, placement, &options).with_context(|| format!("{what} makes no anchors"))?;
    set.save(&args.output)?;
    report::notes(&notes);
    let Placement { units_per_metre, rotation: q, origin } = placement;
    let (low, high) = made.extent_m;
    let name = args.output.display();
    report::note(format_args!(
        "a unit is {:.6} m; scene to cloud: rotation {:.6},{:.6},{:.6},{:.6} (w,x,y,z), then origin at {},{},{}",
        units_per_metre.recip(),
        q.w,
        q.x,
        q.y,
        q.z,
        origin.x,
        origin.y,
        origin.z
    ));
    report::note(format_args!("{} points in {} voxels, from {low:.2} to {high:.2} m", made.points, made.voxels));
    report::line(format_args!(
        "{name}: {} anchors of {} neighbours, {} rounds, voxels {:.2} m (rms) from their anchors",
        set.positions.len(),
        set.neighbours,
        made.iterations,
        made.spread_m
    ));
    Ok(())
}

/// Points, their placement and what they are of, in words.
fn of_file(source: &Path, args: &AnchorsArgs, notes: &mut Vec<String>) -> Result<(Vec<Point>, Placement, String)> {
    let options = PointOptions {
        min_track: args.min_track,
        max_error_px: args.max_error.unwrap_or(f64::INFINITY),
        min_opacity: args.min_opacity,
    };
    let what = source.display().to_string();
    let (mut place, surface) = match Place::load(source, &options)? {
        Place::Points(place) => (place, None),
        Place::Surface(surface) => (Reconstruction::default(), Some(surface)),
    };
    if let Some(cameras) = &args.cameras {
        place.cameras = Reconstruction::load_cameras(cameras)?;
    }
    let mut placement = args.placement.options();
    if let Some(([from, to], metres)) = args.landmarks().map_err(|e| anyhow!("--distance: {e}"))? {
        let unit = place.metres_per_unit([&from, &to], metres).with_context(|| what.clone())?;
        notes.push(format!("{metres} m are {:.4} units: a unit is {unit:.6} m", metres / unit));
        placement.metres_per_unit = Some(unit);
    }
    let placement = place.place(&placement, notes).with_context(|| what.clone())?;
    if place.left_out > 0 {
        notes.push(format!("{} points were left out as too faint, too rarely seen or too far off", place.left_out));
    }
    let points = match surface {
        None => place.points,
        Some(surface) => {
            let edge = f64::from(args.voxel * placement.units_per_metre);
            let points = surface.sample_voxels(edge, args.seed).with_context(|| what.clone())?;
            notes.push(format!("{} triangles, sampled at {} points", surface.triangles(), points.len()));
            points
        }
    };
    Ok((points, placement, what))
}
