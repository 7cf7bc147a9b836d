//! An anchor cloud's streams against its own clips.

use super::Part;
use crate::args::MeasureArgs;
use crate::report;
use anyhow::{Context, Result, bail};
use promenade_baker::streaming::{Distance, StreamReport, compare_streams, poses_within, test_sound};
use promenade_core::{AnchorCloud, Scene};
use promenade_player::Source;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// Poses without `--poses`.
const POSES: u32 = 6;
/// Seed of the random poses.
const SEED: u64 = 1;

pub(crate) fn measure(scene: &Arc<Scene>, cloud: &AnchorCloud, path: &Path, args: &MeasureArgs) -> Result<Part> {
    let (mono, sound) = input(scene, cloud, args)?;
    let poses = poses_within(scene.bounds(), scene.start_pose(), args.poses.unwrap_or(POSES) as usize, SEED);
    let bar = report::Bar::new("comparing", 100.0);
    let found = compare_streams(scene, &mono, &poses, |share| bar.at(100.0 * share))
        .with_context(|| format!("{}: its streams cannot be compared with its clips", path.display()))?;
    drop(bar);
    let rate = scene.grid().sample_rate_hz;
    let sound = format!("{sound}, {:.2} s at {rate} Hz", mono.len() as f64 / rate);
    Ok(Part {
        text: [false, true]
            .map(|markdown| format!("{}\n{}", table(&found, markdown), remarks(&found, cloud, &sound, poses.len(), markdown))),
        json: as_json(&found, cloud, &sound, poses.len()),
    })
}

/// The dry sound at the scene's rate, and its name.
fn input(scene: &Scene, cloud: &AnchorCloud, args: &MeasureArgs) -> Result<(Vec<f32>, String)> {
    let Some(file) = &args.input else {
        return Ok((test_sound(scene.grid(), cloud), "noise bursts and tone clicks".to_owned()));
    };
    let source = Source::open(file, Some(scene.grid().sample_rate_hz.round() as u32))?;
    if source.channels() != 1 {
        bail!("{}: expected a dry sound of 1 channel, found {}", file.display(), source.channels());
    }
    Ok((source.whole()?.swap_remove(0), report::file_name(file)))
}

fn table(found: &StreamReport, markdown: bool) -> String {
    let head = ["stream", "latency ms", "look-ahead hops", "MAG", "LSD dB", "LRE dB", "level dB", "real time"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for stream in &found.streams {
        let distance = |text: fn(Distance) -> String| stream.distance.map_or_else(|| "-".to_owned(), text);
        rows.push(vec![
            stream.name.clone(),
            format!("{:.1}", 1e3 * stream.latency_s),
            stream.lookahead_hops.to_string(),
            distance(|d| format!("{:.4}", d.mag)),
            distance(|d| format!("{:.2}", d.lsd_db)),
            distance(|d| format!("{:.2}", d.lre_db)),
            distance(|d| format!("{:+.2}", d.level_db)),
            stream.real_time.map_or_else(|| "-".to_owned(), |c| format!("{c:.4}")),
        ]);
    }
    report::table(&rows, markdown)
}

/// What stands below the table.
fn remarks(found: &StreamReport, cloud: &AnchorCloud, sound: &str, poses: usize, markdown: bool) -> String {
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
    let (clip_ms, inner_ms) = (1e3 * found.clip_s, 1e3 * found.inner_s);
    lines.push(match found.clips {
        0 => format!("{poses} poses"),
        clips => format!("{poses} poses, {clips} clips of {clip_ms:.0} ms, of each the inner {inner_ms:.0} ms"),
    });
    lines.extend(found.notes.iter().map(|n| format!("note: {n}")));
    let start = if markdown { "- " } else { "" };
    lines.iter().map(|l| format!("{start}{l}\n")).collect()
}

fn as_json(found: &StreamReport, cloud: &AnchorCloud, sound: &str, poses: usize) -> Value {
    let sizes = cloud.model.sizes();
    let distance = |d: Distance| {
        json!({
            "avcloud_mag": d.mag, "audible_lsd_db": d.lsd_db, "avcloud_lre_db": d.lre_db, "level_db": d.level_db,
        })
    };
    let streams: Vec<Value> = found
        .streams
        .iter()
        .map(|stream| {
            json!({
                "name": stream.name,
                "latency_ms": 1e3 * stream.latency_s,
                "lookahead_hops": stream.lookahead_hops,
                "distance": stream.distance.map(distance),
                "real_time": stream.real_time,
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
        "clips": {
            "count": found.clips, "seconds": found.clip_s, "inside_s": found.inner_s, "real_time": found.clip_real_time,
        },
        "decode_ms": found.decode_s.map(|s| 1e3 * s),
        "streams": streams,
        "notes": found.notes,
    })
}
