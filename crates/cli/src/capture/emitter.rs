//! `promenade capture emitter`: where the sound of a capture came from.

use crate::args::EmitterArgs;
use crate::report;
use anyhow::{Result, bail};
use promenade_baker::Capture;
use promenade_baker::capture::{EmitterEstimate, locate_emitter};
use promenade_core::glam::Vec3;
use serde_json::{Value, json};

pub(super) fn run(args: &EmitterArgs) -> Result<()> {
    let capture = Capture::load(&args.capture)?;
    if let (Some(e), true, false) = (capture.emitter(), args.write, args.force) {
        bail!("{}: has an emitter at {}, {}, {} m already; --force replaces it", args.capture.display(), e.x, e.y, e.z);
    }
    let found = locate_emitter(&capture)?;
    let known = capture.emitter();
    if args.write {
        let whole_mm = found.position.to_array().map(|v| (1e3 * v).round() / 1e3);
        Capture::write_emitter(&args.capture, Vec3::from(whole_mm), args.force)?;
    }
    report::json_or(&args.json, &as_json(&found, known), || as_text(&found, known))
}

fn as_text(found: &EmitterEstimate, known: Option<Vec3>) -> String {
    let place = |p: Vec3| format!("{:.2}, {:.2}, {:.2} m", p.x, p.y, p.z);
    let arrival = found.arrival_residual_us.map_or("not kept by the recordings".to_owned(), |us| format!("{us:.0} us"));
    let mut rows = vec![
        ("emitter", place(found.position)),
        ("spread", format!("{:.2} m", found.spread_m)),
        ("clips", found.clips.to_string()),
        ("head radius", format!("{:.1} mm", 1e3 * found.head_radius_m)),
        ("delay between ears", format!("{:.0} us", found.itd_residual_us)),
        ("level", format!("{:.1} dB", found.level_residual_db)),
        ("arrival", arrival),
    ];
    if let Some(known) = known {
        rows.push(("manifest", place(known)));
        rows.push(("off", format!("{:.2} m", found.position.distance(known))));
    }
    rows.into_iter().map(|(name, value)| format!("{name:<20}{value}\n")).collect()
}

fn as_json(found: &EmitterEstimate, known: Option<Vec3>) -> Value {
    json!({
        "emitter": found.position.to_array(), "spread_m": found.spread_m, "clips": found.clips,
        "head_radius_m": found.head_radius_m, "itd_residual_us": found.itd_residual_us,
        "level_residual_db": found.level_residual_db, "arrival_residual_us": found.arrival_residual_us,
        "manifest": known.map(|known| json!({ "emitter": known.to_array(), "off_m": found.position.distance(known) })),
    })
}
