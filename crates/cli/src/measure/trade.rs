//! What each setting of a scene costs, and how far it is off.

use super::{HOST_BLOCK, HOST_RATE_HZ};
use crate::args::MeasureArgs;
use crate::{bake, plot, report, scene};
use anyhow::{Context, Result, bail};
use promenade_baker::atomic;
use promenade_baker::trade::{TradePoint, Way, trade_beside, truth_jnds};
use promenade_core::Scene;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

pub(super) fn run(of: &Arc<Scene>, path: &Path, args: &MeasureArgs) -> Result<()> {
    let other = args.beside.as_deref().map(scene::read).transpose()?;
    let other = other.as_ref().unwrap_or(of);
    let [rate_hz, other_hz] = [of, other].map(|scene| scene.grid().sample_rate_hz);
    if (rate_hz, of.bounds(), of.start_pose()) != (other_hz, other.bounds(), other.start_pose()) {
        bail!("--beside: expected a scene of the same rate, bounds and start pose as {}, found another", path.display());
    }
    let points = trade_beside(of, other, HOST_RATE_HZ, HOST_BLOCK).with_context(|| path.display().to_string())?;
    let chosen = recommended(&points, args);
    if let Some(file) = &args.plot {
        let title = if of.title().is_empty() { report::file_name(path) } else { of.title().to_owned() };
        let (name, error) = drawn(&points);
        let shown: Vec<plot::Point> = points
            .iter()
            .map(|p| {
                // By what is drawn alone: another may be worth its cost for what is not.
                let better = |q: &TradePoint| q.name != p.name && q.real_time <= p.real_time && error(q) <= error(p);
                let stands_out = !points.iter().any(better);
                plot::Point { name: &p.name, x: 100.0 * p.real_time, y: error(p), stands_out }
            })
            .collect();
        let axes = ["processor time of one core, %, walking", name];
        let bytes = match file.extension().and_then(|e| e.to_str()) {
            Some("svg") => plot::points_svg(&title, axes, &shown)?.into_bytes(),
            Some("png") => plot::points_png(&title, axes, &shown)?,
            _ => bail!("{}: expected a name that ends with .svg or .png", file.display()),
        };
        atomic::write(file, &bytes)?;
    }
    let text = |markdown| table(&points, markdown) + "\n" + &sentence(chosen, path, args) + "\n";
    report::tables(&args.files(), &as_json(&points, chosen, path), text)
}

/// The error that is drawn, with its name: to the measurements where there are any; else to the scene's own best while walking,
/// since standing it is often nothing for many settings.
fn drawn(points: &[TradePoint]) -> (&'static str, fn(&TradePoint) -> f64) {
    if points.iter().any(|p| p.to_truth.is_some()) {
        ("error to the measurements, JND", TradePoint::error_jnds)
    } else {
        ("distance to the scene's best while walking, dB", |p| p.walking_db)
    }
}

/// The command that has a setting.
fn command(point: &TradePoint, path: &Path) -> String {
    let file = quoted(&path.display().to_string());
    match point.way {
        Way::Tier => format!("promenade render {file} IN.wav -o OUT.wav --tier {}", point.tier.name()),
        Way::Decodes(hz) => {
            format!("promenade render {file} IN.wav -o OUT.wav --tier {} --decode-rate {hz}", point.tier.name())
        }
        Way::Less(less) => format!("promenade bake less {file} {} -o LESS.promenade", bake::option(less)),
    }
}

/// How the plugin has it.
fn in_the_plugin(point: &TradePoint) -> String {
    match point.way {
        Way::Tier => format!("Tier {}", point.tier.name()),
        Way::Decodes(hz) => format!("Tier {}, Decode Rate {hz} Hz", point.tier.name()),
        Way::Less(_) => format!("play LESS.promenade, Tier {}", point.tier.name()),
    }
}

/// A name as a shell reads it.
fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+".contains(c);
    if !name.is_empty() && name.chars().all(plain) { name.to_owned() } else { format!("'{}'", name.replace('\'', "'\\''")) }
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

fn sentence(chosen: Option<&TradePoint>, path: &Path, args: &MeasureArgs) -> String {
    let wanted = args.budget.map_or_else(
        || format!("The cheapest within {} JND and {} dB walking", args.within, args.walking),
        |percent| format!("The most accurate within {percent} % of a core"),
    );
    match chosen {
        Some(p) => format!(
            "{wanted}: {} ({:.2} %, {:.2} JND, {:.2} dB walking).\n\n  {}\n\nIn the plugin: {}.",
            p.name,
            100.0 * p.real_time,
            p.error_jnds(),
            p.walking_db,
            command(p, path),
            in_the_plugin(p)
        ),
        None => format!("{wanted}: none."),
    }
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
        "heard off, degrees",
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
            p.heard_off_deg.map_or_else(|| "-".to_owned(), |off| format!("{off:.1}")),
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

fn as_json(points: &[TradePoint], chosen: Option<&TradePoint>, path: &Path) -> Value {
    let point = |p: &TradePoint| {
        let e = &p.to_best;
        json!({
            "name": p.name,
            "tier": p.tier.name(),
            "offered": p.way == Way::Tier,
            "command": command(p, path),
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
            "heard_off_deg": p.heard_off_deg,
            "dominated": p.dominated,
        })
    };
    json!({
        "host": { "sample_rate_hz": HOST_RATE_HZ, "block": HOST_BLOCK },
        "settings": points.iter().map(point).collect::<Vec<_>>(),
        "recommended": chosen.map(|p| &p.name),
        "command": chosen.map(|p| command(p, path)),
    })
}
