//! Points of a place, from the reconstruction that the options name.

use crate::args::ReconstructionArgs;
use anyhow::{Context, Result, anyhow};
use promenade_baker::reconstruction::{Camera, Place, Point, PointOptions, Reconstruction};
use promenade_core::network::Placement;
use std::path::Path;

/// What a reconstruction holds, and where.
pub(crate) struct Found {
    pub(crate) points: Vec<Point>,
    pub(crate) cameras: Vec<Camera>,
    /// Numbers of cameras and of the points that they see; none where that is not known.
    pub(crate) sights: Vec<[u32; 2]>,
    pub(crate) placement: Placement,
    /// What the points are of, in words.
    pub(crate) what: String,
}

/// Points, cameras and their placement. The surface of a mesh is sampled for cells of an edge, metres, with a seed.
pub(crate) fn points_of(
    source: &Path,
    args: &ReconstructionArgs,
    cell_m: f32,
    seed: u64,
    notes: &mut Vec<String>,
) -> Result<Found> {
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
        // They are numbers of the cameras before.
        place.sights.clear();
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
            let edge = f64::from(cell_m * placement.units_per_metre);
            let points = surface.sample_voxels(edge, seed).with_context(|| what.clone())?;
            notes.push(format!("{} triangles, sampled at {} points", surface.triangles(), points.len()));
            points
        }
    };
    Ok(Found { points, cameras: place.cameras, sights: place.sights, placement, what })
}
