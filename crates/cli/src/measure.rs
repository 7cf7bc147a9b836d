//! `promenade measure`: a scene against what was held out of it, what its settings cost, or one response.

mod held_out;
mod listener;
mod response;
mod trade;

use crate::args::MeasureArgs;
use crate::{report, scene};
use anyhow::{Result, bail};
use serde_json::Value;
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
    if scene.held_out().is_empty() {
        bail!("{}: expected held-out measurements (bake it with --hold-out) or --trade, found neither", path.display());
    }
    let held_out = held_out::measure(&scene, path, args)?;
    let listened = args.listener.as_ref().map(|set| listener::measure(&scene, set, args)).transpose()?;
    let mut json = held_out.json.clone();
    if let Some(part) = &listened {
        json["listener"] = part.json.clone();
    }
    let parts: Vec<Part> = std::iter::once(held_out).chain(listened).collect();
    let text = |markdown| parts.iter().map(|p| &*p.text[usize::from(markdown)]).collect::<Vec<_>>().join("\n");
    report::tables(&args.json, &args.markdown, &json, text)
}
