//! A scene's rendered responses against the measurements that it was not baked from.

use super::Part;
use crate::args::MeasureArgs;
use crate::report;
use anyhow::{Context, Result, anyhow};
use promenade_baker::measure::{Comparison, MeanErrors, compare_held_out, mean_level_errors_db, response_s};
use promenade_baker::trade::{JND_DB, JND_DECAY, JND_ITD_S};
use promenade_core::{OCTAVES_HZ, ResponseMeasures, Scene};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

pub(crate) fn measure(scene: &Arc<Scene>, path: &Path, args: &MeasureArgs) -> Result<Part> {
    let name = path.display();
    let seconds = args.seconds.unwrap_or_else(|| response_s(scene));
    let comparisons = compare_held_out(scene, seconds).with_context(|| name.to_string())?;
    let mean = MeanErrors::of(&comparisons).ok_or_else(|| anyhow!("{name}: nothing was compared"))?;
    Ok(Part {
        text: [false, true]
            .map(|markdown| as_table(&comparisons, &mean, markdown) + "\n" + &level_table(&comparisons, markdown)),
        json: as_json(&comparisons, &mean),
    })
}

fn as_table(comparisons: &[Comparison], mean: &MeanErrors, markdown: bool) -> String {
    let head =
        ["held-out pose", "ITD us", "error", "ILD dB", "error", "T20 s", "error %", "EDT s", "error %", "C50 dB", "error"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for c in comparisons {
        let (m, r) = (&c.measured, &c.rendered);
        let mut row = vec![c.name.clone()];
        row.extend([format!("{:.0}", 1e6 * m.itd_s), format!("{:+.0}", 1e6 * (r.itd_s - m.itd_s))]);
        row.extend([format!("{:.2}", m.ild_db), format!("{:+.2}", r.ild_db - m.ild_db)]);
        for (m, r) in [(m.t20_s, r.t20_s), (m.edt_s, r.edt_s)] {
            row.push(or_dash(m.map(|m| format!("{m:.3}"))));
            row.push(or_dash(m.zip(r).map(|(m, r)| format!("{:+.1}", 100.0 * (r / m - 1.0)))));
        }
        row.push(or_dash(m.c50_db.map(|m| format!("{m:.2}"))));
        row.push(or_dash(m.c50_db.zip(r.c50_db).map(|(m, r)| format!("{:+.2}", r - m))));
        rows.push(row);
    }
    let none = String::new;
    rows.push(vec![
        "mean magnitude".to_owned(),
        none(),
        format!("{:.0}", 1e6 * mean.itd_s),
        none(),
        format!("{:.2}", mean.ild_db),
        none(),
        or_dash(mean.t20.map(|e| format!("{:.1}", 100.0 * e))),
        none(),
        or_dash(mean.edt.map(|e| format!("{:.1}", 100.0 * e))),
        none(),
        or_dash(mean.c50_db.map(|e| format!("{e:.2}"))),
    ]);
    let (db, percent) = (format!("{JND_DB:.2}"), format!("{:.1}", 100.0 * JND_DECAY));
    let noticed = [format!("{:.0}", 1e6 * JND_ITD_S), db.clone(), percent.clone(), percent, db];
    rows.push(std::iter::once("just noticeable".to_owned()).chain(noticed.into_iter().flat_map(|jnd| [none(), jnd])).collect());
    report::table(&rows, markdown)
}

/// Errors of the level over both ears, of the whole band and by octave; nothing where levels are not known.
fn level_table(comparisons: &[Comparison], markdown: bool) -> String {
    let mean = mean_level_errors_db(comparisons);
    if mean.is_empty() {
        return String::new();
    }
    let octaves = OCTAVES_HZ.iter().map(|hz| format!("{hz} Hz"));
    let head = ["level, error in dB".to_owned(), "all".to_owned()].into_iter().chain(octaves).take(1 + mean.len());
    let mut rows = vec![head.collect::<Vec<String>>()];
    for c in comparisons.iter().filter(|c| !c.levels_db[0].is_empty()) {
        let [measured, rendered] = &c.levels_db;
        let errors = measured.iter().zip(rendered).map(|(m, r)| format!("{:+.2}", r - m));
        rows.push(std::iter::once(c.name.clone()).chain(errors).collect());
    }
    rows.push(std::iter::once("mean magnitude".to_owned()).chain(mean.iter().map(|e| format!("{e:.2}"))).collect());
    rows.push(std::iter::once("just noticeable".to_owned()).chain(mean.iter().map(|_| format!("{JND_DB:.2}"))).collect());
    report::table(&rows, markdown) + "\n"
}

/// A measure that has no value is shown as a dash.
fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "-".to_owned())
}

fn as_json(comparisons: &[Comparison], mean: &MeanErrors) -> Value {
    let poses: Vec<Value> = comparisons
        .iter()
        .map(|c| {
            let [measured, rendered] = [&c.measured, &c.rendered].map(measures);
            json!({ "name": c.name, "measured": measured, "rendered": rendered, "levels_db": c.levels_db })
        })
        .collect();
    json!({
        "poses": poses,
        "mean_absolute_error": {
            "itd_us": 1e6 * mean.itd_s,
            "ild_db": mean.ild_db,
            "t20_percent": mean.t20.map(|e| 100.0 * e),
            "edt_percent": mean.edt.map(|e| 100.0 * e),
            "c50_db": mean.c50_db,
            "level_db": mean_level_errors_db(comparisons),
        },
        "just_noticeable": {
            "itd_us": 1e6 * JND_ITD_S,
            "ild_db": JND_DB,
            "t20_percent": 100.0 * JND_DECAY,
            "edt_percent": 100.0 * JND_DECAY,
            "c50_db": JND_DB,
            "level_db": JND_DB,
        },
    })
}

fn measures(b: &ResponseMeasures) -> Value {
    json!({ "itd_us": 1e6 * b.itd_s, "ild_db": b.ild_db, "t20_s": b.t20_s, "edt_s": b.edt_s, "c50_db": b.c50_db })
}
