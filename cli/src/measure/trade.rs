//! What each setting of a scene costs, and how far it is off.

use super::{HOST_BLOCK, HOST_RATE_HZ};
use crate::args::{MeasureArgs, TableForm};
use crate::{plot, report};
use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_baker::trade::{TradePoint, trade, truth_jnds};
use promenade_core::Scene;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

pub(super) fn run(scene: &Arc<Scene>, path: &Path, args: &MeasureArgs) -> Result<()> {
    let points = trade(scene, HOST_RATE_HZ, HOST_BLOCK).with_context(|| path.display().to_string())?;
    let chosen = recommended(&points, args);
    if let Some(file) = &args.plot {
        let title = if scene.title().is_empty() { report::file_name(path) } else { scene.title().to_owned() };
        let shown: Vec<plot::Point> = points
            .iter()
            .map(|p| plot::Point { name: &p.name, x: 100.0 * p.real_time, y: p.error_jnds(), stands_out: !p.dominated })
            .collect();
        let axes = ["processor time of one core, %, walking", error_name(&points)];
        let bytes = match file.extension().and_then(|e| e.to_str()) {
            Some("svg") => plot::points_svg(&title, axes, &shown)?.into_bytes(),
            Some("png") => plot::points_png(&title, axes, &shown)?,
            _ => bail!("{}: expected a name that ends with .svg or .png", file.display()),
        };
        atomic::write(file, &bytes)?;
    }
    report::print(&match args.format {
        TableForm::Json => format!("{:#}\n", as_json(&points, chosen)),
        TableForm::Text | TableForm::Markdown => {
            let sentence = sentence(chosen, args);
            table(&points, args.format == TableForm::Markdown) + "\n" + &sentence + "\n"
        }
    })
}

/// The cheapest setting within the wanted error, or with a budget the most accurate within that.
fn recommended<'a>(points: &'a [TradePoint], args: &MeasureArgs) -> Option<&'a TradePoint> {
    match args.budget {
        Some(percent) => {
            let within = points.iter().filter(|p| 100.0 * p.real_time <= percent);
            within.min_by(|a, b| a.error_jnds().total_cmp(&b.error_jnds()))
        }
        None => points.iter().find(|p| p.error_jnds() <= args.within && p.walking_db <= args.walking),
    }
}

fn sentence(chosen: Option<&TradePoint>, args: &MeasureArgs) -> String {
    let wanted = args.budget.map_or_else(
        || format!("The cheapest within {} JND and {} dB walking", args.within, args.walking),
        |percent| format!("The most accurate within {percent} % of a core"),
    );
    match chosen {
        Some(p) => format!("{wanted}: {} ({:.2} %, {:.2} JND).", p.name, 100.0 * p.real_time, p.error_jnds()),
        None => format!("{wanted}: none."),
    }
}

fn error_name(points: &[TradePoint]) -> &'static str {
    let truth = points.iter().any(|p| p.to_truth.is_some());
    if truth { "error to the measurements, JND" } else { "error to the scene's best, JND" }
}

fn table(points: &[TradePoint], markdown: bool) -> String {
    let truth = points.iter().any(|p| p.to_truth.is_some());
    let mut head = vec![
        "setting",
        "% of a core",
        "x STFT",
        "MB",
        "ITD us",
        "ILD dB",
        "T20 %",
        "C50 dB",
        "octaves dB",
        "walking dB",
        "JND",
    ];
    if truth {
        head.push("JND to measured");
    }
    head.push("");
    let mut rows = vec![head.into_iter().map(str::to_owned).collect::<Vec<_>>()];
    for p in points {
        let e = &p.to_best;
        let mut row = vec![
            p.name.clone(),
            format!("{:.2}", 100.0 * p.real_time),
            format!("{:.1}", p.times_stft),
            format!("{:.1}", p.memory_bytes as f64 / 1e6),
            format!("{:.0}", 1e6 * e.itd_s),
            format!("{:.2}", e.ild_db),
            e.t20.map_or_else(|| "-".to_owned(), |t| format!("{:.1}", 100.0 * t)),
            format!("{:.2}", e.c50_db),
            format!("{:.2}", e.octaves_db),
            format!("{:.2}", p.walking_db),
            format!("{:.2}", e.jnds()),
        ];
        if truth {
            row.push(p.to_truth.as_ref().map_or_else(|| "-".to_owned(), |t| format!("{:.2}", truth_jnds(t))));
        }
        row.push(if p.dominated { "dominated" } else { "" }.to_owned());
        rows.push(row);
    }
    report::table(&rows, markdown)
}

fn as_json(points: &[TradePoint], chosen: Option<&TradePoint>) -> Value {
    let point = |p: &TradePoint| {
        let e = &p.to_best;
        json!({
            "name": p.name,
            "tier": p.tier.name(),
            "offered": p.offered,
            "real_time": p.real_time,
            "times_stft": p.times_stft,
            "memory_bytes": p.memory_bytes,
            "to_best": {
                "itd_us": 1e6 * e.itd_s,
                "ild_db": e.ild_db,
                "t20_percent": e.t20.map(|t| 100.0 * t),
                "c50_db": e.c50_db,
                "octaves_db": e.octaves_db,
                "walking_lsd_db": p.walking_db,
                "jnd": e.jnds(),
            },
            "to_measured": p.to_truth.as_ref().map(|t| json!({
                "itd_us": 1e6 * t.itd_s,
                "ild_db": t.ild_db,
                "t20_percent": t.t20.map(|t| 100.0 * t),
                "edt_percent": t.edt.map(|t| 100.0 * t),
                "c50_db": t.c50_db,
                "jnd": truth_jnds(t),
            })),
            "dominated": p.dominated,
        })
    };
    json!({
        "host": { "sample_rate_hz": HOST_RATE_HZ, "block": HOST_BLOCK },
        "settings": points.iter().map(point).collect::<Vec<_>>(),
        "recommended": chosen.map(|p| &p.name),
    })
}
