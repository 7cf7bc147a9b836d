//! `promenade capture check`: what a capture holds.

use crate::args::CheckArgs;
use crate::report;
use anyhow::Result;
use promenade_baker::capture::{Emitter, level_dbfs};
use promenade_baker::{Capture, Split};
use promenade_core::glam::Vec3;
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
    report::json_or(&args.json, &as_json(&capture, &levels), || as_text(&capture, &levels))
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

/// Nearest and farthest clip of one emitter alone, metres, where there are such clips; and their number.
fn distances(capture: &Capture, emitter: usize) -> (Option<[f32; 2]>, usize) {
    let clips = capture.clips.iter().filter(|clip| capture.emitter_of(clip) == Some(emitter));
    let all: Vec<f32> = clips.map(|c| c.pose.position.distance(capture.emitters[emitter].position)).collect();
    let near = all.iter().copied().reduce(f32::min);
    (near.zip(all.iter().copied().reduce(f32::max)).map(|(near, far)| [near, far]), all.len())
}

/// Each emitter in words.
fn emitters(capture: &Capture) -> Vec<String> {
    let one = |(number, emitter): (usize, &Emitter)| {
        let Emitter { name, position: Vec3 { x, y, z }, facing_deg } = emitter;
        let named = if name.is_empty() { String::new() } else { format!("{name}: ") };
        let facing = facing_deg.map_or(String::new(), |[yaw, pitch]| format!(", facing {yaw:.0}, {pitch:.0} degrees"));
        let reach = match distances(capture, number) {
            (Some([near, far]), clips) => format!("; {clips} clips {near:.2} to {far:.2} m from it"),
            _ => "; no clips of it alone".to_owned(),
        };
        format!("{named}{x:.2}, {y:.2}, {z:.2} m{facing}{reach}")
    };
    let known: Vec<String> = capture.emitters.iter().enumerate().map(one).collect();
    if known.is_empty() { vec!["unknown".to_owned()] } else { known }
}

fn as_text(capture: &Capture, levels: &[Levels]) -> String {
    let seconds: f64 = capture.tracks.iter().map(|t| t.samples() as f64).sum::<f64>() / capture.sample_rate_hz;
    let mut rows = vec![
        ("title", capture.title.clone()),
        ("credit", capture.credit.clone()),
        ("licence", capture.licence.clone()),
        ("sample rate", format!("{} Hz", capture.sample_rate_hz)),
        ("tracks", format!("{}, {seconds:.1} s", capture.tracks.len())),
    ];
    rows.extend(emitters(capture).into_iter().map(|text| ("emitter", text)));
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
    let emitter = |(number, e): (usize, &Emitter)| {
        let (distance_m, clips) = distances(capture, number);
        json!({
            "name": e.name, "position": e.position.to_array(), "facing_deg": e.facing_deg,
            "clips": clips, "distance_m": distance_m,
        })
    };
    let emitters: Vec<Value> = capture.emitters.iter().enumerate().map(emitter).collect();
    let mixes = capture.clips.iter().filter(|clip| capture.is_mix(clip)).count();
    json!({
        "title": capture.title, "credit": capture.credit, "licence": capture.licence,
        "sample_rate_hz": capture.sample_rate_hz, "tracks": capture.tracks.len(),
        "emitters": emitters, "mixes": mixes,
        "splits": splits, "notes": capture.notes,
    })
}
