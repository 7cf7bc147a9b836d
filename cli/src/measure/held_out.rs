//! A scene's rendered responses against the measurements that it was not baked from.

use crate::args::{MeasureArgs, TableForm};
use crate::{report, scene};
use anyhow::{Result, anyhow, bail};
use promenade_baker::cost::{TierCost, tier_costs};
use promenade_baker::measure::{Comparison, MeanErrors, compare_held_out};
use promenade_core::metrics::Binaural;
use serde_json::{Value, json};
use std::path::Path;

/// Host that costs are measured for.
const HOST_RATE_HZ: f64 = 48_000.0;
const HOST_BLOCK: usize = 512;
/// Seconds of sound that a cost is measured on.
const COST_S: f64 = 2.0;

pub(crate) fn run(path: &Path, args: &MeasureArgs) -> Result<()> {
    let scene = scene::read(path)?;
    let name = path.display();
    if scene.held_out().is_empty() {
        bail!("{name}: expected a scene with held-out measurements (bake it with --hold-out), found none");
    }
    let longest = scene.tail().t60_s.iter().fold(0.0_f32, |a, b| a.max(*b));
    let seconds = args.seconds.unwrap_or(1.5 * f64::from(longest)).max(0.25);
    if !(0.25..=60.0).contains(&seconds) {
        bail!("seconds: expected 0.25 to 60, found {seconds}");
    }
    let comparisons = compare_held_out(&scene, seconds).map_err(|(pose, error)| {
        anyhow::Error::from(error).context(format!("{name}: held-out pose {pose} cannot be measured"))
    })?;
    let mean = MeanErrors::of(&comparisons).ok_or_else(|| anyhow!("{name}: nothing was compared"))?;
    let costs = tier_costs(&scene, HOST_RATE_HZ, HOST_BLOCK, COST_S);
    let text = match args.format {
        TableForm::Json => format!("{:#}\n", as_json(&comparisons, &mean, &costs)),
        form => {
            let markdown = form == TableForm::Markdown;
            as_table(&comparisons, &mean, markdown) + "\n" + &cost_table(&costs, markdown)
        }
    };
    report::print(&text)
}

fn as_table(comparisons: &[Comparison], mean: &MeanErrors, markdown: bool) -> String {
    let head =
        ["held-out pose", "ITD us", "error", "ILD dB", "error", "T20 s", "error %", "EDT s", "error %", "C50 dB", "error"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for c in comparisons {
        let (m, r) = (&c.measured, &c.rendered);
        rows.push(vec![
            c.name.clone(),
            format!("{:.0}", 1e6 * m.itd_s),
            format!("{:+.0}", 1e6 * (r.itd_s - m.itd_s)),
            format!("{:.2}", m.ild_db),
            format!("{:+.2}", r.ild_db - m.ild_db),
            format!("{:.3}", m.t20_s),
            format!("{:+.1}", 100.0 * (r.t20_s / m.t20_s - 1.0)),
            format!("{:.3}", m.edt_s),
            format!("{:+.1}", 100.0 * (r.edt_s / m.edt_s - 1.0)),
            format!("{:.2}", m.c50_db),
            format!("{:+.2}", r.c50_db - m.c50_db),
        ]);
    }
    let none = String::new;
    rows.push(vec![
        "mean magnitude".to_owned(),
        none(),
        format!("{:.0}", 1e6 * mean.itd_s),
        none(),
        format!("{:.2}", mean.ild_db),
        none(),
        format!("{:.1}", 100.0 * mean.t20),
        none(),
        format!("{:.1}", 100.0 * mean.edt),
        none(),
        format!("{:.2}", mean.c50_db),
    ]);
    report::table(&rows, markdown)
}

/// Cost of each tier for a listener who walks and turns.
fn cost_table(costs: &[TierCost], markdown: bool) -> String {
    let head = ["tier", "share of real time, one core", "times a bare STFT"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for c in costs {
        rows.push(vec![c.tier.name().to_owned(), format!("{:.4}", c.real_time), format!("{:.1}", c.times_stft)]);
    }
    report::table(&rows, markdown)
}

fn as_json(comparisons: &[Comparison], mean: &MeanErrors, costs: &[TierCost]) -> Value {
    let costs: Vec<Value> = costs
        .iter()
        .map(|c| json!({ "tier": c.tier.name(), "real_time": c.real_time, "times_stft": c.times_stft }))
        .collect();
    let poses: Vec<Value> = comparisons
        .iter()
        .map(|c| json!({ "name": c.name, "measured": binaural(&c.measured), "rendered": binaural(&c.rendered) }))
        .collect();
    json!({
        "poses": poses,
        "cost": { "sample_rate_hz": HOST_RATE_HZ, "block": HOST_BLOCK, "tiers": costs },
        "mean_absolute_error": {
            "itd_us": 1e6 * mean.itd_s,
            "ild_db": mean.ild_db,
            "t20_percent": 100.0 * mean.t20,
            "edt_percent": 100.0 * mean.edt,
            "c50_db": mean.c50_db,
        },
    })
}

fn binaural(b: &Binaural) -> Value {
    json!({ "itd_us": 1e6 * b.itd_s, "ild_db": b.ild_db, "t20_s": b.t20_s, "edt_s": b.edt_s, "c50_db": b.c50_db })
}
