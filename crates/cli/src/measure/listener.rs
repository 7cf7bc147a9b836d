//! A scene in a listener's terms.

use super::Part;
use crate::args::MeasureArgs;
use crate::report;
use anyhow::{Context, Result};
use promenade_baker::listener::{HeardOff, listened};
use promenade_baker::{LoadOptions, Responses};
use promenade_core::Scene;
use serde_json::json;
use std::path::Path;
use std::sync::Arc;

pub(crate) fn measure(scene: &Arc<Scene>, path: &Path, args: &MeasureArgs) -> Result<Part> {
    let options = LoadOptions { root: args.root.clone(), ..LoadOptions::default() };
    let set = Responses::load(path, &options)?;
    let found = listened(scene, &set).with_context(|| path.display().to_string())?;
    let rows = [("scene", found.scene), ("nearest measurement", found.nearest), ("KEMAR, free field", found.other_head)];
    let mut table = vec![["heard off", "lateral, degrees", "elevation, degrees", "front-back %"].map(str::to_owned).to_vec()];
    for (name, off) in rows {
        let or_dash = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1}"));
        let HeardOff { lateral_deg, elevation_deg, confused } = off;
        let confused = confused.map(|share| 100.0 * share);
        table.push(vec![name.to_owned(), format!("{lateral_deg:.1}"), or_dash(elevation_deg), or_dash(confused)]);
    }
    let as_json = |off: HeardOff| {
        let front_back = off.confused.map(|share| 100.0 * share);
        json!({
            "lateral_deg": off.lateral_deg,
            "elevation_deg": off.elevation_deg,
            "front_back_percent": front_back,
        })
    };
    Ok(Part {
        text: [false, true].map(|markdown| report::table(&table, markdown)),
        json: json!({
            "poses": found.poses,
            "scene": as_json(found.scene),
            "nearest": as_json(found.nearest),
            "kemar": as_json(found.other_head),
        }),
    })
}
