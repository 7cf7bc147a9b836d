//! Streams of an anchor cloud beside its own clips.

use promenade_baker::BakeError;
use promenade_baker::checkpoint::Imported;
use promenade_baker::cloud_scene::{CloudSceneOptions, cloud_scene};
use promenade_baker::streaming::{StreamReport, bursts_and_clicks, compare_streams, poses_within};
use promenade_core::network::{CloudKind, CloudModel, CloudParts};
use promenade_core::published::{ConvMode, Projection};
use promenade_core::{Latency, Provenance, Scene, StftGrid};
use promenade_player::{Player, Playing};
use promenade_testing::clouds;
use promenade_testing::clouds::Sizes;
use std::sync::Arc;

const GRID: StftGrid = StftGrid { sample_rate_hz: 8000.0, n_fft: 64, hop: 15 };
const SMALL: Sizes = Sizes { anchors: 4, bands: 33, frames: 60, width: 32, hyper: 0 };

/// Weights that look random, of which masks near 1 are heard.
fn audible(kind: CloudKind, sizes: Sizes) -> CloudParts {
    let mut parts = clouds::parts(kind, sizes);
    for name in ["mix_prj.weight", "out.4.weight", "out.4.bias"] {
        parts.weights.get_mut(name).unwrap().values.iter_mut().for_each(|v| *v *= 0.1);
    }
    parts.weights.get_mut("mix_prj.bias").unwrap().values.fill(1.0);
    parts
}

fn scene(parts: CloudParts, conv: ConvMode) -> Arc<Scene> {
    scene_on(GRID, parts, conv)
}

fn scene_on(grid: StftGrid, parts: CloudParts, conv: ConvMode) -> Arc<Scene> {
    let model = CloudModel::new(parts).unwrap();
    let options = CloudSceneOptions {
        provenance: Provenance::default(),
        bounds: None,
        start_pose: None,
        taps: 16,
        conv,
        projection: Projection::Diagonal,
        seed: 1,
    };
    Arc::new(cloud_scene(Imported { model, grid, notes: Vec::new() }, options).unwrap())
}

fn measure(scene: &Arc<Scene>, seconds: f64) -> Result<StreamReport, BakeError> {
    let sound = bursts_and_clicks(GRID.sample_rate_hz, seconds);
    compare_streams(scene, &sound, &poses_within(scene.bounds(), scene.start_pose(), 2, 1), |_| ())
}

fn names(report: &StreamReport) -> Vec<&str> {
    report.streams.iter().map(|r| r.name.as_str()).collect()
}

#[test]
fn what_is_played_in_frames_alone_is_said() {
    // Four hops, which can be told apart.
    let sooner = |conv| {
        let scene = scene_on(StftGrid { hop: 16, ..GRID }, audible(CloudKind::SimpleSh, SMALL), conv);
        let player = Player::at_latency(&scene, GRID.sample_rate_hz, Playing::Stream, Latency::None);
        player.map(|player| player.playing()).map_err(|error| error.to_string())
    };
    assert_eq!(sooner(ConvMode::Off), Ok(Playing::Stream));
    let error = sooner(ConvMode::LookAhead).unwrap_err();
    assert!(error.contains("expected frame") && error.contains("found none"), "{error}");
}

#[test]
fn a_stream_that_is_the_clip_is_at_no_distance() {
    // Without time filters, convolution with its look-ahead is all that a clip's inner frames have.
    let mut parts = audible(CloudKind::SimpleSh, SMALL);
    parts.weights.retain(|name, _| !name.starts_with("time_") && name != "_acoustic_features_t");
    let report = measure(&scene(parts, ConvMode::LookAhead), 3.0).unwrap();
    assert_eq!(names(&report), ["source", "decoded", "published"]);
    let distance = |row: usize| report.streams[row].distance.unwrap();
    assert!(!report.notes.iter().any(|n| n.contains("silent")), "{:?}", report.notes);
    let same = distance(2);
    assert!(same.mag < 2e-5 && same.lsd_db < 1e-3 && same.lre_db < 1e-3 && same.level_db.abs() < 1e-3, "{same:?}");
    assert!((0..2).all(|row| distance(row).mag > 1e-3), "the others are not: {:?}", report.streams);
    assert_eq!(report.streams[2].lookahead_hops, 5);
    assert!(report.streams[0].real_time.is_none() && report.streams[1..].iter().all(|r| r.real_time.is_some_and(|t| t > 0.0)));
}

#[test]
fn what_a_scene_can_be_played_as_is_compared() {
    let report = measure(&scene(audible(CloudKind::SimpleSh, SMALL), ConvMode::Causal), 1.0).unwrap();
    assert_eq!(names(&report), ["source", "decoded", "published"]);
    assert!(report.streams.iter().all(|r| r.distance.is_some_and(|d| d.mag.is_finite() && d.lsd_db > 0.0)), "{report:?}");
    assert!(report.streams.iter().all(|r| r.lookahead_hops == 0), "convolution that does not look ahead");
    assert!(report.clips > 3 && report.decode_s.is_some());
}

#[test]
fn what_cannot_be_compared_is_said() {
    let mut short = audible(CloudKind::SimpleSh, Sizes { frames: 15, ..SMALL });
    short.weights.retain(|name, _| !name.starts_with("out."));
    let report = measure(&scene(short, ConvMode::Off), 1.0).unwrap();
    assert!(report.streams.iter().all(|r| r.distance.is_none()) && names(&report) == ["source", "decoded"], "{report:?}");
    assert!(report.notes.iter().any(|n| n.contains("clips have 210 samples")), "{:?}", report.notes);

    let other_bins = audible(CloudKind::Sh, Sizes { bands: 20, ..SMALL });
    let report = measure(&scene(other_bins, ConvMode::Off), 1.0).unwrap();
    assert_eq!(names(&report), ["source", "decoded"], "what does not need the model's own bins");
    assert!(report.notes.iter().any(|n| n.contains("20 bands, the grid has 33 bins")), "{:?}", report.notes);

    let failure = measure(&scene(audible(CloudKind::Sh, SMALL), ConvMode::Off), 0.05).unwrap_err();
    assert_eq!(failure.to_string(), "input: expected at least 0.11 s, a clip of the model, found 0.05 s");
}

#[test]
fn poses_where_nothing_is_heard_are_left_out() {
    let mut silent = audible(CloudKind::SimpleSh, SMALL);
    silent.weights.retain(|name, _| !["time_", "_acoustic", "out."].iter().any(|s| name.starts_with(s)));
    for (name, value) in [("mix_prj.weight", 0.0), ("mix_prj.bias", -1.0)] {
        silent.weights.get_mut(name).unwrap().values.fill(value);
    }
    let report = measure(&scene(silent, ConvMode::Off), 1.5).unwrap();
    assert!(report.streams.iter().all(|r| r.distance.is_none()), "{report:?}");
    assert!(report.notes.iter().any(|n| n.contains("at 2 of 2 poses the clips are silent")), "{:?}", report.notes);
}
