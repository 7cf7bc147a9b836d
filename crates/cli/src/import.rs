//! `promenade import`: a published checkpoint becomes a scene.

use crate::args::ImportArgs;
use crate::{inspect, report, scene};
use anyhow::{Context, Result};
use promenade_baker::anchors::AnchorSet;
use promenade_baker::checkpoint::import;
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene};
use promenade_core::Provenance;
use promenade_core::network::Placement;
use promenade_paths::PlacementOptions;

pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let stated = args.anchors.as_deref().map(AnchorSet::stored_placement).transpose()?.flatten();
    let given = args.placement.options();
    let placement = match stated {
        None if given == PlacementOptions::default() => None,
        stated => Some(given.over(&stated.unwrap_or(Placement::IDENTITY), &[])?),
    };
    let imported = import(&args.checkpoint, args.anchors.as_deref(), placement)?;
    let options = CloudSceneOptions {
        provenance: Provenance {
            title: args.title.clone().unwrap_or_else(|| report::file_name(&args.checkpoint.with_extension(""))),
            credit: args.credit.clone(),
            licence: args.licence.clone(),
            recipe: recipe(args),
            notes: Vec::new(),
        },
        bounds: args.bounds,
        start_pose: args.start,
        taps: args.taps as usize,
        conv: args.conv,
        projection: args.projection,
        seed: args.seed,
    };
    let scene = cloud_scene(imported, options).with_context(|| format!("{}: makes no scene", args.checkpoint.display()))?;
    report::notes(&scene.provenance().notes);
    let bytes = scene::write(&args.output, &scene)?;
    report::line(format_args!("{}: {} kB", args.output.display(), bytes.div_ceil(1000)));
    Ok(())
}

/// The command for the scene's provenance: what was chosen, without the places of files on this machine.
fn recipe(args: &ImportArgs) -> String {
    let list = |values: &[f32]| values.iter().map(f32::to_string).collect::<Vec<_>>().join(",");
    let start = args.start.map(|pose| {
        let (yaw, pitch, roll) = pose.ypr();
        list(&[&pose.position.to_array()[..], &[yaw, pitch, roll].map(f32::to_degrees)].concat())
    });
    let options = [
        ("anchors", args.anchors.as_deref().map(report::file_name)),
        ("bounds", args.bounds.map(|(low, high)| list(&[low.to_array(), high.to_array()].concat()))),
        ("start", start),
        ("taps", Some(args.taps.to_string())),
        ("conv", Some(args.conv.name().to_owned())),
        ("projection", Some(inspect::projection(args.projection))),
        ("seed", Some(args.seed.to_string())),
    ];
    let given = options.into_iter().filter_map(|(option, value)| value.map(|v| format!(" --{option} {v}")));
    format!("promenade import {}{}{}", report::file_name(&args.checkpoint), args.placement, given.collect::<String>())
}
