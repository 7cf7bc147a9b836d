//! `promenade anchors`: the surfaces of a place become the anchors of a model.

use crate::args::AnchorsArgs;
use crate::reconstruction::{Found, points_of};
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::anchors::{AnchorOptions, AnchorSet, WALL_COLOURS, box_points};
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;

pub(crate) fn run(args: &AnchorsArgs) -> Result<()> {
    let options = AnchorOptions { count: args.count, neighbours: args.neighbours, voxel_m: args.voxel, seed: args.seed };
    let mut notes = Vec::new();
    let (points, placement, what) = match (&args.source, args.size) {
        (Some(source), _) => {
            let Found { points, placement, what, .. } = points_of(source, &args.world, args.voxel, args.seed, &mut notes)?;
            (points, placement, what)
        }
        (None, Some(size)) => {
            if args.world.placement.options() != PlacementOptions::default() || args.world.distance.is_some() {
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
