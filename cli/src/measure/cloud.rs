//! An anchor cloud's streams against its own clips.

use super::Part;
use crate::args::{MeasureArgs, TableForm};
use crate::{progress, report};
use anyhow::{Context, Result, bail};
use promenade_baker::projection::{Distance, ProjectionReport, bursts_and_clicks, compare_projections, poses_within};
use promenade_baker::{resample, wav};
use promenade_core::{AnchorCloud, Scene};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// Poses without `--poses`.
const POSES: u32 = 6;
/// Seed of the random poses.
const SEED: u64 = 1;
/// Length of the sound without `--input`, at least, seconds and clips.
const SOUND_S: f64 = 3.0;
const SOUND_CLIPS: f64 = 3.0;

pub(crate) fn measure(scene: &Arc<Scene>, cloud: &AnchorCloud, path: &Path, args: &MeasureArgs) -> Result<Part> {
    let (mono, sound) = input(scene, cloud, args)?;
    let poses = poses_within(scene.bounds(), scene.start_pose(), args.poses.unwrap_or(POSES) as usize, SEED);
    let bar = progress::of_sound(100.0);
    let found = compare_projections(scene, &mono, &poses, |share| bar.at(100.0 * share))
        .with_context(|| format!("{}: its streams cannot be compared with its clips", path.display()))?;
    drop(bar);
    let rate = scene.grid().sample_rate_hz;
    let sound = format!("{sound}, {:.2} s at {rate} Hz", mono.len() as f64 / rate);
    let markdown = args.format == TableForm::Markdown;
    Ok(Part {
        text: format!("{}\n{}", table(&found, markdown), remarks(&found, cloud, &sound, poses.len(), markdown)),
        json: as_json(&found, cloud, &sound, poses.len()),
    })
}

/// The sound at the scene's rate, and what it is.
fn input(scene: &Scene, cloud: &AnchorCloud, args: &MeasureArgs) -> Result<(Vec<f32>, String)> {
    let grid = scene.grid();
    let Some(file) = &args.input else {
        let clip_s = cloud.model.sizes().frames as f64 * grid.hop_s();
        let seconds = SOUND_S.max(SOUND_CLIPS * clip_s);
        return Ok((bursts_and_clicks(grid.sample_rate_hz, seconds), "noise bursts and tone clicks".to_owned()));
    };
    let wav = wav::read(file)?;
    if wav.channels.len() != 1 {
        bail!("{}: expected a dry sound of 1 channel, found {}", file.display(), wav.channels.len());
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked when the scene was read")]
    let model_hz = grid.sample_rate_hz.round() as u32;
    let mono = resample::signal(&wav.channels, wav.sample_rate_hz, model_hz)?.swap_remove(0);
    let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok((mono, name))
}

fn table(found: &ProjectionReport, markdown: bool) -> String {
    let head = ["stream", "latency ms", "look-ahead hops", "MAG", "LSD dB", "LRE dB", "level dB", "real time"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for row in &found.rows {
        let distance = |text: fn(Distance) -> String| row.distance.map_or_else(|| "-".to_owned(), text);
        rows.push(vec![
            row.name.clone(),
            format!("{:.1}", 1e3 * row.latency_s),
            row.lookahead_hops.to_string(),
            distance(|d| format!("{:.4}", d.mag)),
            distance(|d| format!("{:.2}", d.lsd_db)),
            distance(|d| format!("{:.2}", d.lre_db)),
            distance(|d| format!("{:+.2}", d.level_db)),
            row.real_time.map_or_else(|| "-".to_owned(), |c| format!("{c:.4}")),
        ]);
    }
    report::table(&rows, markdown)
}

/// What stands below the table.
fn remarks(found: &ProjectionReport, cloud: &AnchorCloud, sound: &str, poses: usize, markdown: bool) -> String {
    let sizes = cloud.model.sizes();
    let mut lines = vec![format!(
        "{}: {} anchors, {} bands, width {}, {} layers, {} frames",
        cloud.model.parts().kind.name(),
        sizes.anchors,
        sizes.bands,
        sizes.width,
        sizes.layers,
        sizes.frames
    )];
    if let Some(decode) = found.decode_s {
        lines.push(format!("decoding a pose: {:.2} ms", 1e3 * decode));
    }
    if let Some(clip) = found.clip_real_time {
        lines.push(format!("clips: {clip:.4} of real time"));
    }
    lines.push(format!("input: {sound}"));
    let (clip_ms, inside_ms) = (1e3 * found.clip_s, 1e3 * found.inside_s);
    lines.push(match found.clips {
        0 => format!("{poses} poses"),
        clips => format!("{poses} poses, {clips} clips of {clip_ms:.0} ms, of each the inner {inside_ms:.0} ms"),
    });
    lines.extend(found.notes.iter().map(|n| format!("note: {n}")));
    let start = if markdown { "- " } else { "" };
    lines.iter().map(|l| format!("{start}{l}\n")).collect()
}

fn as_json(found: &ProjectionReport, cloud: &AnchorCloud, sound: &str, poses: usize) -> Value {
    let sizes = cloud.model.sizes();
    let distance = |d: Distance| json!({ "avcloud_mag": d.mag, "audible_lsd_db": d.lsd_db, "avcloud_lre_db": d.lre_db, "level_db": d.level_db });
    let streams: Vec<Value> = found
        .rows
        .iter()
        .map(|row| {
            json!({
                "name": row.name,
                "latency_ms": 1e3 * row.latency_s,
                "lookahead_hops": row.lookahead_hops,
                "distance": row.distance.map(distance),
                "real_time": row.real_time,
            })
        })
        .collect();
    json!({
        "model": {
            "kind": cloud.model.parts().kind.name(),
            "anchors": sizes.anchors,
            "bands": sizes.bands,
            "width": sizes.width,
            "layers": sizes.layers,
            "frames": sizes.frames,
        },
        "input": sound,
        "poses": poses,
        "clips": { "count": found.clips, "seconds": found.clip_s, "inside_s": found.inside_s, "real_time": found.clip_real_time },
        "decode_ms": found.decode_s.map(|s| 1e3 * s),
        "streams": streams,
        "notes": found.notes,
    })
}
