//! `promenade capture check`: what a capture holds.

use crate::args::CheckArgs;
use crate::report;
use anyhow::Result;
use promenade_baker::capture::level_dbfs;
use promenade_baker::{Capture, Split};
use serde_json::{Value, json};

/// Levels of all clips of a split, dB relative to full scale.
struct Levels {
    split: Split,
    clips: usize,
    seconds: f64,
    /// Dry sound, left and right ear: quietest clip, mean of all, largest sample.
    channels: [(f64, f64, f64); 3],
}

pub(super) fn run(args: &CheckArgs) -> Result<()> {
    let capture = Capture::load(&args.capture)?;
    let levels = [Split::Train, Split::Test].map(|split| levels(&capture, split));
    report::print(&if args.json { format!("{:#}\n", as_json(&capture, &levels)) } else { as_text(&capture, &levels) })
}

fn levels(capture: &Capture, split: Split) -> Levels {
    let clips: Vec<_> = capture.split(split).collect();
    let of = |channel: usize| {
        let all = clips.iter().map(|c| match channel {
            0 => capture.dry(c, 0),
            ear => capture.binaural(c)[ear - 1].to_vec(),
        });
        let (mut quietest, mut power, mut peak) = (f64::INFINITY, 0.0, 0.0_f32);
        for x in all {
            let level = level_dbfs(&x);
            quietest = quietest.min(level);
            power += 10.0_f64.powf(level / 10.0);
            peak = x.iter().fold(peak, |m, v| m.max(v.abs()));
        }
        (quietest, 10.0 * (power / clips.len().max(1) as f64).log10(), 20.0 * f64::from(peak).log10())
    };
    let seconds = clips.iter().map(|c| c.len as f64).sum::<f64>() / capture.sample_rate_hz;
    Levels { split, clips: clips.len(), seconds, channels: [0, 1, 2].map(of) }
}

/// The nearest and the farthest clip from the emitter, metres.
fn distances(capture: &Capture) -> Option<(f32, f32)> {
    let emitter = capture.emitter?;
    let all = capture.clips.iter().map(|c| c.pose.position.distance(emitter));
    Some(all.fold((f32::INFINITY, 0.0), |(low, high), d| (low.min(d), high.max(d))))
}

fn as_text(capture: &Capture, levels: &[Levels]) -> String {
    let seconds: f64 = capture.tracks.iter().map(|t| t.dry.len() as f64).sum::<f64>() / capture.sample_rate_hz;
    let emitter = capture.emitter.map_or("unknown".to_owned(), |e| {
        let (near, far) = distances(capture).unwrap_or_default();
        format!("{:.2}, {:.2}, {:.2} m; clips {near:.2} to {far:.2} m from it", e.x, e.y, e.z)
    });
    let mut rows = vec![
        ("title", capture.title.clone()),
        ("credit", capture.credit.clone()),
        ("licence", capture.licence.clone()),
        ("sample rate", format!("{} Hz", capture.sample_rate_hz)),
        ("tracks", format!("{}, {seconds:.1} s", capture.tracks.len())),
        ("emitter", emitter),
    ];
    for l in levels {
        rows.push((l.split.name(), format!("{} clips, {:.1} s", l.clips, l.seconds)));
    }
    rows.extend(capture.notes.iter().map(|n| ("note", n.clone())));
    let mut text = report::properties(rows);
    let head = ["dBFS", "quietest clip", "mean", "peak"];
    let mut table = vec![head.map(str::to_owned).to_vec()];
    for l in levels.iter().filter(|l| l.clips > 0) {
        for (name, (quietest, mean, peak)) in ["dry", "left", "right"].iter().zip(l.channels) {
            let mut row = vec![format!("{} {name}", l.split.name())];
            row.extend([quietest, mean, peak].map(|v| format!("{v:.1}")));
            table.push(row);
        }
    }
    text.push('\n');
    text + &report::table(&table, false)
}

fn as_json(capture: &Capture, levels: &[Levels]) -> Value {
    let splits: Vec<Value> = levels
        .iter()
        .map(|l| {
            let channel = |(quietest, mean, peak): (f64, f64, f64)| {
                json!({ "quietest_clip_dbfs": quietest, "mean_dbfs": mean, "peak_dbfs": peak })
            };
            let [dry, left, right] = l.channels.map(channel);
            json!({ "split": l.split.name(), "clips": l.clips, "seconds": l.seconds, "dry": dry, "left": left, "right": right })
        })
        .collect();
    json!({
        "title": capture.title, "credit": capture.credit, "licence": capture.licence,
        "sample_rate_hz": capture.sample_rate_hz, "tracks": capture.tracks.len(),
        "emitter": capture.emitter.map(|e| e.to_array()), "distance_m": distances(capture).map(|(a, b)| [a, b]),
        "splits": splits, "notes": capture.notes,
    })
}
