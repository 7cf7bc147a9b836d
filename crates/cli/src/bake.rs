//! `promenade bake`: measured responses become a scene, a scene's anchor cloud a table, and a scene one that holds less.

use crate::args::{BakeFieldArgs, BakeLessArgs, BakeResponsesArgs, BakeSource, LevelsArg, SideArg};
use crate::{report, scene};
use anyhow::{Context, Result};
use promenade_baker::field::{FieldOptions, bake_cloud};
use promenade_baker::trade::{STANDARD_JNDS, front};
use promenade_baker::{BakeOptions, CONTENT, HoldOut, Levels, Side, bake_responses, read_head};
use promenade_core::{Provenance, Scene};

pub(crate) fn run(source: &BakeSource) -> Result<()> {
    match source {
        BakeSource::Responses(args) => responses(args),
        BakeSource::Field(args) => field(args),
        BakeSource::Less(args) => reduce(args),
    }
}

fn responses(args: &BakeResponsesArgs) -> Result<()> {
    let hold_out = HoldOut::parse(&args.hold_out)?;
    let azimuth_positive = args.azimuth_positive.map(|side| match side {
        SideArg::Left => Side::Left,
        SideArg::Right => Side::Right,
    });
    let mut set = args.set.load(azimuth_positive)?;
    if let Some(title) = &args.title {
        set.title.clone_from(title);
    }
    set.levels = match args.levels {
        Some(LevelsArg::Measured) => Some(Levels::Measured),
        Some(LevelsArg::Even) => Some(Levels::Even),
        None => set.levels,
    };
    report::notes(&set.notes);
    let (used, held) = hold_out.split(&set)?;
    let options = BakeOptions {
        window_s: args.window_ms / 1e3,
        seed: args.seed,
        head: args.head.as_deref().map(read_head).transpose()?,
        recipe: recipe(args),
    };
    let bar = report::Bar::new("baking", 1.0);
    let scene = bake_responses(&set, |response, index| hold_out.selects(response, index), &options)
        .with_context(|| format!("{}: cannot be baked", args.set.path.display()))?;
    drop(bar);
    // What counts scenes' content up is for those who make the factory's.
    scene.provenance().notes.iter().filter(|note| *note != CONTENT).for_each(report::note);
    let bytes = scene::write_kept(&args.output, scene, args.less)?;
    report::line(format_args!(
        "{}: {} responses baked, {} held out, {} kB",
        args.output.display(),
        used.len(),
        held.len(),
        bytes.div_ceil(1000)
    ));
    Ok(())
}

fn field(args: &BakeFieldArgs) -> Result<()> {
    let scene = scene::read(&args.scene)?;
    let radians = |(low, high): (f32, f32)| (low.to_radians(), high.to_radians());
    let options = FieldOptions {
        bounds: args.bounds.unwrap_or_else(|| scene.bounds()),
        pitch: radians(args.pitch),
        roll: radians(args.roll),
        error_db: args.error_db,
        max_bytes: (args.max_mb * 1e6) as usize,
        seed: args.seed,
    };
    let bar = report::Bar::new("baking", 1.0);
    let baked = bake_cloud(&scene, &options, |share| bar.at(share));
    drop(bar);
    let baked = baked.with_context(|| format!("{}: cannot be baked", args.scene.display()))?;
    if let Some(note) = baked.provenance().notes.last() {
        report::note(note);
    }
    let bytes = scene::write_kept(&args.output, baked, args.less)?;
    report::line(format_args!("{}: {} kB", args.output.display(), bytes.div_ceil(1000)));
    Ok(())
}

fn reduce(args: &BakeLessArgs) -> Result<()> {
    let name = args.scene.display();
    let scene = scene::read(&args.scene)?;
    let mut parts = scene.parts().clone();
    if args.less.within.is_some() {
        let Provenance { recipe, notes, .. } = &mut parts.provenance;
        if !recipe.is_empty() {
            notes.push(format!("reduced from a scene made by: {recipe}"));
        }
        *recipe = format!("promenade bake less {}", report::file_name(&args.scene));
    } else {
        let bar = report::Bar::new("comparing settings", 1.0);
        let points = front(&scene, &STANDARD_JNDS, &|| true);
        drop(bar);
        parts.front = points.with_context(|| format!("{name}: settings of it cannot be compared"))?;
        report::line(format_args!("{} settings", parts.front.len()));
    }
    let scene = Scene::new(parts).with_context(|| format!("{name}: cannot be reduced"))?;
    let bytes = scene::write_kept(&args.output, scene, args.less)?;
    report::line(format_args!("{}: {} kB", args.output.display(), bytes.div_ceil(1000)));
    Ok(())
}

/// The command for the scene's provenance: what was chosen, without the places of files on this machine.
fn recipe(args: &BakeResponsesArgs) -> String {
    let name = report::file_name(&args.set.path);
    let mut text = format!("promenade bake responses {name} --hold-out {}", args.hold_out);
    if let Some(side) = args.azimuth_positive {
        text += match side {
            SideArg::Left => " --azimuth-positive left",
            SideArg::Right => " --azimuth-positive right",
        };
    }
    if let Some(levels) = args.levels {
        text += match levels {
            LevelsArg::Measured => " --levels measured",
            LevelsArg::Even => " --levels even",
        };
    }
    if let Some(n) = args.set.source {
        text += &format!(" --emitter-number {n}");
    }
    let head = args.head.as_deref().map_or(String::new(), |file| format!(" --head {}", report::file_name(file)));
    text + &format!(" --window-ms {} --seed {}{head}", args.window_ms, args.seed)
}
