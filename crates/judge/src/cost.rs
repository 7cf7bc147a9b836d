//! The processor time that renderings of scenes take.

use crate::poses::{noise, walk};
use cpu_time::ThreadTime;
use promenade_core::{BlockParams, Renderer, RendererConfig, Scene, Spatializer};
use promenade_metrics::statistics::median;
use std::sync::Arc;

/// Runs that a median is taken over.
const RUNS: usize = 5;

/// Processor seconds per second of audio of renderings of scenes at a host's rate and block, on a second of noise, the listener
/// walking at 1 m/s and turning at 90 degrees a second; `None` for one that cannot be played.
///
/// Processor time of the calling thread; medians of 5 runs in which all take turns.
#[must_use]
pub fn real_times(scenes: &[Arc<Scene>], sample_rate_hz: f64, block: usize) -> Vec<Option<f64>> {
    let input = noise(sample_rate_hz as usize);
    let mut engines: Vec<Option<(Spatializer, Vec<f64>)>> = scenes
        .iter()
        .map(|scene| {
            let config = RendererConfig::inline(scene, sample_rate_hz, 1);
            let renderer = Renderer::new(Arc::clone(scene), config).ok()?;
            let mut spatializer = Spatializer::new(sample_rate_hz);
            spatializer.install(Box::new(renderer));
            Some((spatializer, Vec::new()))
        })
        .collect();
    let (mut left, mut right) = (vec![0.0; block], vec![0.0; block]);
    for _ in 0..RUNS {
        for (engine, scene) in engines.iter_mut().zip(scenes) {
            let Some((spatializer, times)) = engine else { continue };
            let params = BlockParams::default();
            let start = scene.start_pose();
            let began = ThreadTime::now();
            for (b, x) in input.chunks(block).enumerate() {
                let out = [&mut left[..x.len()], &mut right[..x.len()]];
                spatializer.process(&[x], &[], out, &params, |i| walk(&start, (b * block + i) as f64 / sample_rate_hz));
            }
            times.push(began.elapsed().as_secs_f64() * sample_rate_hz / input.len() as f64);
        }
    }
    engines.into_iter().map(|engine| median(engine?.1)).collect()
}
