//! `promenade measure`: a scene against what was held out of it and against its own clips, what its settings cost, or one
//! response.

mod held_out;
mod listener;
mod response;
mod streams;
mod trade;

pub(crate) use trade::words;

use crate::args::MeasureArgs;
use crate::{report, scene};
use anyhow::{Result, bail};
use serde_json::{Value, json};
use std::path::Path;

/// Host that costs are measured for.
pub(crate) const HOST_RATE_HZ: f64 = 48_000.0;
pub(crate) const HOST_BLOCK: usize = 512;

/// One part of the figures of a scene, as text, as Markdown and as JSON.
struct Part {
    text: [String; 2],
    json: Value,
}

pub(crate) fn run(args: &MeasureArgs) -> Result<()> {
    match (&args.scene, &args.response) {
        (Some(scene), None) => whole_scene(scene, args),
        (_, Some(file)) => response::run(file, args),
        (None, None) => bail!("expected a scene or --response, found neither"),
    }
}

fn whole_scene(path: &Path, args: &MeasureArgs) -> Result<()> {
    let scene = scene::read(path)?;
    if args.trade {
        return trade::run(&scene, path, args);
    }
    let name = path.display();
    let (held_out, cloud) = (!scene.held_out().is_empty(), scene.cloud());
    if !held_out && cloud.is_none() {
        bail!("{name}: expected held-out measurements (bake it with --hold-out) or an anchor cloud, found neither");
    }
    if cloud.is_none() && (args.input.is_some() || args.poses.is_some()) {
        bail!("{name}: --input and --poses are for a scene with an anchor cloud, found a field only");
    }
    if !held_out && args.seconds.is_some() {
        bail!("{name}: --seconds is for a scene with held-out measurements, found none");
    }
    let held_out = held_out.then(|| held_out::measure(&scene, path, args)).transpose()?;
    let cloud = cloud.map(|c| streams::measure(&scene, c, path, args)).transpose()?;
    let listened = args.listener.as_ref().map(|set| listener::measure(&scene, set, args)).transpose()?;
    let mut json = held_out.as_ref().map_or_else(|| json!({}), |part| part.json.clone());
    for (name, part) in [("cloud", &cloud), ("listener", &listened)] {
        if let Some(part) = part {
            json[name] = part.json.clone();
        }
    }
    let parts: Vec<Part> = held_out.into_iter().chain(cloud).chain(listened).collect();
    let text = |markdown| parts.iter().map(|p| &*p.text[usize::from(markdown)]).collect::<Vec<_>>().join("\n");
    report::tables(&args.files(), &json, text)
}
