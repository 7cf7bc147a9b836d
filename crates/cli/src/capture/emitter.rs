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
    let off = capture.emitter().map(|e| Off::new(&capture, found.position, e));
    if args.write {
        let whole_mm = found.position.to_array().map(|v| (1e3 * v).round() / 1e3);
        Capture::write_emitter(&args.capture, Vec3::from(whole_mm), args.force)?;
    }
    report::json_or(&args.json, &as_json(&found, off.as_ref()), || as_text(&found, off.as_ref()))
}

/// How far an estimate is from the emitter that the manifest has.
struct Off {
    known: Vec3,
    distance_m: f32,
    /// Angle between both as the listener sees them, degrees: median over all clips, and what 95 % stay below.
    median_deg: f32,
    most_deg: f32,
}

impl Off {
    fn new(capture: &Capture, found: Vec3, known: Vec3) -> Self {
        let angle = |p: Vec3| (found - p).angle_between(known - p).to_degrees();
        let mut angles: Vec<f32> = capture.clips.iter().map(|c| angle(c.pose.position)).collect();
        angles.sort_by(f32::total_cmp);
        let below = |percent: usize| angles.get(angles.len() * percent / 100).copied().unwrap_or(0.0);
        Self { known, distance_m: found.distance(known), median_deg: below(50), most_deg: below(95) }
    }
}

fn as_text(found: &EmitterEstimate, off: Option<&Off>) -> String {
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
    if let Some(off) = off {
        rows.push(("manifest", place(off.known)));
        rows.push(("off", format!("{:.2} m", off.distance_m)));
        rows.push(("direction off", format!("{:.1} degrees, 95 % of clips {:.1}", off.median_deg, off.most_deg)));
    }
    rows.into_iter().map(|(name, value)| format!("{name:<20}{value}\n")).collect()
}

fn as_json(found: &EmitterEstimate, off: Option<&Off>) -> Value {
    json!({
        "emitter": found.position.to_array(), "spread_m": found.spread_m, "clips": found.clips,
        "head_radius_m": found.head_radius_m, "itd_residual_us": found.itd_residual_us,
        "level_residual_db": found.level_residual_db, "arrival_residual_us": found.arrival_residual_us,
        "manifest": off.map(|off| json!({
            "emitter": off.known.to_array(), "off_m": off.distance_m,
            "direction_off_deg": { "median": off.median_deg, "p95": off.most_deg },
        })),
    })
}
