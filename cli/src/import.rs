//! `promenade import`: a published checkpoint becomes a scene.

use crate::args::ImportArgs;
use crate::scene;
use anyhow::{Context, Result};
use promenade_baker::anchors::AnchorSet;
use promenade_baker::checkpoint::{ImportOptions, import};
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene};
use promenade_core::glam::{Quat, Vec3};
use promenade_core::network::Alignment;
use promenade_core::{Provenance, Tier};

pub(crate) fn run(args: &ImportArgs) -> Result<()> {
    let aligned = args.up.is_some() || args.origin.is_some() || args.metres_per_unit.is_some();
    let alignment = Alignment {
        scale: args.metres_per_unit.unwrap_or(1.0).recip(),
        rotation: Quat::from_rotation_arc(Vec3::Z, args.up.unwrap_or(Vec3::NEG_Y)).normalize(),
        translation: args.origin.unwrap_or(Vec3::ZERO),
    };
    let options = ImportOptions {
        kind: args.kind,
        max_norm: args.max_norm,
        sample_rate_hz: args.sample_rate,
        n_fft: args.n_fft,
        hop: args.hop,
        heads: args.heads,
        convention: args.convention,
        alignment: match &args.anchors {
            _ if aligned => Some(alignment),
            // What `promenade anchors` was told.
            Some(file) => AnchorSet::stored_alignment(file)?,
            None => None,
        },
    };
    let imported = import(&args.checkpoint, args.anchors.as_deref(), &options)?;
    let name = |path: &std::path::Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let options = CloudSceneOptions {
        provenance: Provenance {
            title: args.title.clone().unwrap_or_else(|| name(args.checkpoint.with_extension("").as_path())),
            credit: args.credit.clone(),
            licence: args.licence.clone(),
            recipe: format!(
                "promenade import {} --taps {} --conv {} --seed {}",
                name(&args.checkpoint),
                args.taps,
                args.conv.name(),
                args.seed
            ),
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
    for note in &scene.provenance().notes {
        eprintln!("note: {note}");
    }
    let bytes = scene::write(&args.output, &scene)?;
    let tiers: Vec<_> = Tier::ALL.into_iter().filter(|t| scene.has_tier(*t)).map(Tier::name).collect();
    eprintln!("{}: tiers {}, {} kB", args.output.display(), tiers.join(", "), bytes.div_ceil(1000));
    Ok(())
}
