//! `promenade bake`.

use crate::args::{BakeFieldArgs, BakeResponsesArgs, SideArg};
use crate::{progress, scene};
use anyhow::{Context, Result, bail};
use promenade_baker::field::{Decode, FieldOptions, bake_field};
use promenade_baker::{BakeOptions, HoldOut, LoadOptions, Responses, Side, bake_responses};
use promenade_core::Scene;
use promenade_core::decode::CloudDecoder;

pub(crate) fn responses(args: &BakeResponsesArgs) -> Result<()> {
    let hold_out = HoldOut::parse(&args.hold_out)?;
    let azimuth_positive = args.azimuth_positive.map(|side| match side {
        SideArg::Left => Side::Left,
        SideArg::Right => Side::Right,
    });
    let options = LoadOptions { root: args.root.clone(), azimuth_positive, source: args.source_number };
    let mut set = Responses::load(&args.source, &options)?;
    if let Some(title) = &args.title {
        set.title.clone_from(title);
    }
    for note in &set.notes {
        eprintln!("note: {note}");
    }
    let (used, held) = hold_out.split(&set)?;
    let options =
        BakeOptions { window_s: args.window_ms / 1e3, early_s: args.early_ms / 1e3, seed: args.seed, recipe: recipe(args) };
    let scene = bake_responses(&set, |response, index| hold_out.selects(response, index), &options)
        .with_context(|| format!("{}: cannot be baked", args.source.display()))?;
    for note in &scene.provenance().notes {
        eprintln!("note: {note}");
    }
    let bytes = scene::write(&args.output, &scene)?;
    eprintln!(
        "{}: {} responses baked, {} held out, {} kB",
        args.output.display(),
        used.len(),
        held.len(),
        bytes.div_ceil(1000)
    );
    Ok(())
}

pub(crate) fn field(args: &BakeFieldArgs) -> Result<()> {
    let scene = scene::read(&args.scene)?;
    let name = args.scene.display();
    if scene.cloud().is_none() {
        bail!("{name}: expected a scene with an anchor cloud, found a field only");
    }
    let radians = |(low, high): (f32, f32)| (low.to_radians(), high.to_radians());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let max_bytes = (args.max_mb * 1e6) as usize;
    let options = FieldOptions {
        bounds: args.bounds.unwrap_or_else(|| scene.bounds()),
        pitch: radians(args.pitch),
        roll: radians(args.roll),
        error_db: args.error_db,
        max_bytes,
        seed: args.seed,
    };
    let decoder = || -> Option<Decode<'_>> {
        let mut decoder = CloudDecoder::new(&scene)?;
        let mut answer = decoder.blank();
        Some(Box::new(move |pose| {
            decoder.decode(pose, &mut answer);
            answer.transfer.clone()
        }))
    };
    let bar = progress::of_sound(1.0);
    let (field, report) = bake_field(scene.shape(), decoder, &options, |share| bar.at(share))
        .with_context(|| format!("{name}: cannot be baked"))?;
    drop(bar);
    let [x, y, z, yaw, pitch, roll] = report.nodes;
    let errors = &report.errors;
    let note = format!(
        "field of {x} x {y} x {z} positions, {yaw} x {pitch} x {roll} directions (yaw, pitch, roll), {} + {} shapes, {} kB; its levels \
         differ from the decoder's by {:.2} dB in the median, {:.2} dB at 95 %, {:.2} dB at 99 % (1000 random poses, masks above -40 dB)",
        report.ranks[0],
        report.ranks[1],
        report.bytes.div_ceil(1000),
        errors.median_db,
        errors.p95_db,
        errors.p99_db
    );
    eprintln!("note: {note}");
    let mut parts = scene.parts().clone();
    parts.provenance.notes.retain(|n| !n.starts_with("field of "));
    parts.provenance.notes.push(note);
    (parts.bounds, parts.field) = (options.bounds, Some(field));
    let baked = Scene::new(parts).with_context(|| format!("{name}: cannot be baked"))?;
    let bytes = scene::write(&args.output, &baked)?;
    eprintln!("{}: {} kB", args.output.display(), bytes.div_ceil(1000));
    Ok(())
}

/// The command for the scene's provenance: what was chosen, without the places of files on this machine.
fn recipe(args: &BakeResponsesArgs) -> String {
    let name = args.source.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut text = format!("promenade bake responses {name} --hold-out {}", args.hold_out);
    if let Some(side) = args.azimuth_positive {
        text += match side {
            SideArg::Left => " --azimuth-positive left",
            SideArg::Right => " --azimuth-positive right",
        };
    }
    if let Some(n) = args.source_number {
        text += &format!(" --source {n}");
    }
    text + &format!(" --window-ms {} --early-ms {} --seed {}", args.window_ms, args.early_ms, args.seed)
}
