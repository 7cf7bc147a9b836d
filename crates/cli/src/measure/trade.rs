//! What less of a scene costs, and how far it is off.

use super::{HOST_BLOCK, HOST_RATE_HZ};
use crate::args::MeasureArgs;
use crate::report;
use crate::scene::words;
use anyhow::{Context, Result};
use promenade_baker::cost::real_times;
use promenade_baker::trade::{OTHER_SEED, STANDARD_JNDS, elsewhere, errors_to_measurements, front, largest};
use promenade_core::{Audible, FrontPoint, Scene, Setting};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// A setting with what was measured of it besides the front.
struct Row {
    point: FrontPoint,
    /// Of a core.
    real_time: f64,
    memory_bytes: usize,
    to_measured: Option<Audible>,
    elsewhere: Option<Audible>,
}

pub(super) fn run(of: &Arc<Scene>, path: &Path, args: &MeasureArgs) -> Result<()> {
    let points =
        front(of, &[&STANDARD_JNDS[..], &[args.within]].concat(), &|| true).with_context(|| path.display().to_string())?;
    let chosen = FrontPoint::within(&points, args.within).copied();
    let rows = rows(of, &points, args)?;
    let text = |markdown| table(&rows, of, markdown) + "\n" + &sentence(chosen.as_ref(), of, args.within) + "\n";
    report::tables(&args.json, &args.markdown, &as_json(&rows, of, chosen.as_ref(), args.within), text)
}

fn rows(of: &Arc<Scene>, points: &[FrontPoint], args: &MeasureArgs) -> Result<Vec<Row>> {
    let scenes: Vec<Arc<Scene>> = points.iter().filter_map(|p| of.with_setting(p.setting).map(Arc::new)).collect();
    let times = real_times(&scenes, HOST_RATE_HZ, HOST_BLOCK);
    let settings: Vec<Setting> = points.iter().map(|p| p.setting).collect();
    let elsewhere =
        args.poses.map(|count| elsewhere(of, &settings, count as usize, OTHER_SEED)).transpose()?.unwrap_or_default();
    let some = |errors: &[Audible]| (!errors.is_empty()).then(|| largest(errors));
    let all = points.iter().zip(&scenes).zip(times).enumerate();
    let rows = all.map(|(n, ((point, scene), real_time))| {
        Ok(Row {
            point: *point,
            real_time: real_time.unwrap_or(f64::NAN),
            memory_bytes: scene.memory_bytes(),
            to_measured: some(&errors_to_measurements(scene)?),
            elsewhere: elsewhere.get(n).and_then(|errors| some(errors)),
        })
    });
    rows.collect()
}

/// What to choose, and what plays the scene so.
fn sentence(chosen: Option<&FrontPoint>, of: &Scene, within: f32) -> String {
    match chosen {
        Some(p) => format!(
            "Within {within} JND: {} ({:.0} % of the operations, {:.2} JND by {}). `render --within {within}` plays it.",
            words(p.setting, of),
            100.0 * p.cost,
            p.error.jnds,
            p.error.measure.name()
        ),
        None => format!("Within {within} JND: none."),
    }
}

fn table(rows: &[Row], of: &Scene, markdown: bool) -> String {
    let error = |error: &Audible| format!("{:.2} by {}", error.jnds, error.measure.name());
    let some = |found: &Option<Audible>| found.as_ref().map(error);
    let mut head = vec!["setting", "operations, %", "% of a core", "MB", "JND"];
    head.extend(rows.iter().any(|row| row.elsewhere.is_some()).then_some("JND elsewhere"));
    head.extend(rows.iter().any(|row| row.to_measured.is_some()).then_some("JND to measured"));
    let mut lines = vec![head.into_iter().map(str::to_owned).collect::<Vec<_>>()];
    for row in rows {
        let mut line = vec![
            words(row.point.setting, of),
            format!("{:.0}", 100.0 * row.point.cost),
            format!("{:.2}", 100.0 * row.real_time),
            format!("{:.1}", row.memory_bytes as f64 / 1e6),
            error(&row.point.error),
        ];
        line.extend(some(&row.elsewhere));
        line.extend(some(&row.to_measured));
        lines.push(line);
    }
    report::table(&lines, markdown)
}

fn as_json(rows: &[Row], of: &Scene, chosen: Option<&FrontPoint>, within: f32) -> Value {
    let error = |error: &Audible| json!({ "jnd": error.jnds, "measure": error.measure.name() });
    let row = |row: &Row| {
        let Setting { taps, images, order, refresh, waves, decodes } = row.point.setting;
        json!({
            "name": words(row.point.setting, of),
            "setting": {
                "taps": taps, "images": images, "order": order, "refresh": refresh, "waves": waves, "decodes": decodes,
            },
            "operations": row.point.cost,
            "real_time": row.real_time,
            "memory_bytes": row.memory_bytes,
            "error": error(&row.point.error),
            "elsewhere": row.elsewhere.as_ref().map(error),
            "to_measured": row.to_measured.as_ref().map(error),
        })
    };
    json!({
        "host": { "sample_rate_hz": HOST_RATE_HZ, "block": HOST_BLOCK },
        "front": rows.iter().map(row).collect::<Vec<_>>(),
        "within": within,
        "chosen": chosen.map(|p| words(p.setting, of)),
    })
}
