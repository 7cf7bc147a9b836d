//! `promenade anchors`: the surfaces of a place become the anchors of a model.

use crate::args::AnchorsArgs;
use anyhow::{Context, Result, anyhow, bail};
use promenade_baker::anchors::{AnchorOptions, AnchorSet, WALL_COLOURS, box_points};
use promenade_baker::reconstruction::{AlignmentOptions, Place, Point, PointOptions, Reconstruction};
use promenade_core::network::Alignment;
use std::path::Path;

/// Points of a mesh for each square of a voxel's edge.
const POINTS_PER_SQUARE: f64 = 12.0;
/// Points of a mesh, at most.
const MOST_POINTS: f64 = 5e6;

pub(crate) fn run(args: &AnchorsArgs) -> Result<()> {
    let options = AnchorOptions { count: args.count, neighbours: args.neighbours, voxel_m: args.voxel, seed: args.seed };
    let mut notes = Vec::new();
    let (points, alignment, what) = match (&args.source, args.size) {
        (Some(source), _) => of_file(source, args, &mut notes)?,
        (None, Some(size)) => {
            if args.up.is_some() || args.origin.is_some() || args.metres_per_unit.is_some() || args.distance.is_some() {
                bail!("expected a file for the options of its alignment, found a box, which is in metres and upright");
            }
            (box_points(size, args.voxel, &WALL_COLOURS)?, Alignment::IDENTITY, "a box".to_owned())
        }
        (None, None) => bail!("expected a file or --box, found neither"),
    };
    let (set, report) =
        AnchorSet::from_points(&points, alignment, &options).with_context(|| format!("{what} makes no anchors"))?;
    set.save(&args.output)?;
    for note in &notes {
        eprintln!("note: {note}");
    }
    let Alignment { scale, rotation: q, translation: t } = alignment;
    let (low, high) = report.extent_m;
    let name = args.output.display();
    eprintln!(
        "note: a unit is {:.6} m; scene to cloud: rotation {:.6},{:.6},{:.6},{:.6} (w,x,y,z), then origin at {},{},{}",
        scale.recip(),
        q.w,
        q.x,
        q.y,
        q.z,
        t.x,
        t.y,
        t.z
    );
    eprintln!("note: {} points in {} voxels, from {low:.2} to {high:.2} m", report.points, report.voxels);
    eprintln!(
        "{name}: {} anchors of {} neighbours, {} rounds, voxels {:.2} m (rms) from their anchors",
        set.positions.len(),
        set.neighbours,
        report.iterations,
        report.spread_m
    );
    Ok(())
}

/// Points, alignment and what they are of, in words.
fn of_file(source: &Path, args: &AnchorsArgs, notes: &mut Vec<String>) -> Result<(Vec<Point>, Alignment, String)> {
    let options = PointOptions {
        min_track: args.min_track,
        max_error_px: args.max_error.unwrap_or(f64::INFINITY),
        min_opacity: args.min_opacity,
    };
    let alignment_options =
        AlignmentOptions { up: args.up, scale: args.scale().map_err(|e| anyhow!("--distance: {e}"))?, origin: args.origin };
    let what = source.display().to_string();
    let (mut place, surface) = match Place::load(source, &options)? {
        Place::Points(place) => (place, None),
        Place::Surface(surface) => (Reconstruction::default(), Some(surface)),
    };
    if let Some(cameras) = &args.cameras {
        place.cameras = Reconstruction::load_cameras(cameras)?;
    }
    let alignment = place.align(&alignment_options, notes).with_context(|| what.clone())?;
    if place.left_out > 0 {
        notes.push(format!("{} points were left out as too faint, too rarely seen or too far off", place.left_out));
    }
    let points = match surface {
        None => place.points,
        Some(surface) => {
            let edge = f64::from(args.voxel * alignment.scale);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited")]
            let count = (surface.area() / edge.powi(2) * POINTS_PER_SQUARE).clamp(1000.0, MOST_POINTS) as usize;
            notes.push(format!("{} triangles, sampled at {count} points", surface.triangles()));
            surface.sample(count, args.seed).with_context(|| what.clone())?
        }
    };
    Ok((points, alignment, what))
}
