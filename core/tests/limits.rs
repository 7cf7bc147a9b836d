//! Scenes at the edge of what a scene may be.

use promenade_core::{Bands, BlockParams, Pose, RenderError, Renderer, Scene, SceneError, StftGrid, TailModel, TransferShape};
use promenade_testing::noise;
use promenade_testing::scenes::{DIRECT, render, room, spatializer};
use std::sync::Arc;

const RATE: f64 = 48_000.0;

/// A direct sound of gain 1 with a room of `taps` silent taps and a faint late part.
fn plain(grid: StftGrid, taps: usize, t60_s: f32) -> Result<Scene, SceneError> {
    let bands = Bands::new(vec![0.0, 1_000.0]).unwrap();
    let mut transfer = TransferShape { bins: grid.bins(), bands: 2, taps }.silent();
    transfer.mixture.fill(1.0);
    transfer.late.fill(1e-6);
    let tail = TailModel { seed: 1, t60_s: vec![t60_s; 2], coherence: vec![0.0; 2], by_phase: false };
    Scene::of_transfer(&transfer, grid, bands, tail, 0.45 * grid.sample_rate_hz as f32)
}

#[test]
fn the_shortest_reverberation_and_the_shortest_hops_sound() {
    let grid = |n_fft, hop| StftGrid { sample_rate_hz: RATE, n_fft, hop };
    for (grid, taps, t60_s) in [
        (grid(20, 5), 8, 0.002),
        (grid(960, 240), 8, 0.002),
        (grid(960, 240), 0, 0.001),
        (grid(2048, 4), 0, 0.3),
        (grid(512, 1), 0, 0.3),
    ] {
        let scene = Arc::new(plain(grid, taps, t60_s).unwrap());
        let mut s = spatializer(&scene, RATE);
        let (latency, input) = (s.latency_samples(), noise(1, 3_000));
        let room = render(&mut s, &input, &[512], &BlockParams::default(), |_| Pose::IDENTITY);
        let name = format!("{grid:?}, {t60_s} s");
        assert!(room.iter().flatten().all(|v| v.is_finite() && v.abs() < 100.0), "{name}");
        assert!(room.iter().all(|ear| ear[latency..].iter().any(|v| v.abs() > 0.1)), "{name}: something is heard");
        s.reset();
        let draft = BlockParams { trim: DIRECT, ..BlockParams::default() };
        let direct = render(&mut s, &input, &[512], &draft, |_| Pose::IDENTITY);
        // The room fades out over the first hops.
        let from = latency + 8 * grid.hop;
        let worst = direct[0][from..].iter().zip(&input[from - latency..]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{name}: a gain of 1 leaves the input as it is, {worst}");
    }
}

#[test]
fn a_scene_that_would_take_gigabytes_or_minutes_is_refused_before_anything_is_made_of_it() {
    let grid = |sample_rate_hz, n_fft, hop| StftGrid { sample_rate_hz, n_fft, hop };
    for (grid, taps, named) in [
        (grid(768_000.0, 65_534, 16_383), 4_096, "memory"),
        (grid(768_000.0, 65_534, 100), 64, "work"),
        (grid(RATE, 8_192, 1), 0, "work"),
    ] {
        let error = plain(grid, taps, 1.0).err().unwrap().to_string();
        assert!(error.contains(named) && error.contains("at most"), "{error}");
    }
    // Within the limits at its own rate, but not at the fastest.
    let scene = Arc::new(plain(grid(8_000.0, 1_400, 350), 4_096, 1.0).unwrap());
    assert!(scene.playable_at(RATE).is_ok());
    let error = Renderer::new(scene, 768_000.0).err().unwrap();
    assert!(matches!(error, RenderError::Cost(_)), "{error}");
    for rate in [2_000.0, 8_000.0, RATE, 384_000.0, 768_000.0] {
        assert!(room(16_000.0, 0.5, 0.1).playable_at(rate).is_ok(), "{rate}");
    }
    assert_eq!(room(16_000.0, 0.5, 0.1).playable_at(1e6), Err(RenderError::SampleRate { found: 1e6 }));
}
