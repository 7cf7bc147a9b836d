//! The cost of rendering a scene, tier by tier.

use crate::poses::{noise, walk};
use cpu_time::ThreadTime;
use promenade_core::{BlockParams, Quality, Renderer, RendererConfig, Scene, Spatializer, StftGrid, Tier};
use promenade_metrics::statistics::median;
use std::sync::Arc;

/// Runs that a median is taken over.
const RUNS: usize = 5;

/// Cost of one tier on one core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TierCost {
    /// The tier.
    pub tier: Tier,
    /// Processor seconds per second of audio, the listener walking at 1 m/s and turning at 90 degrees a second.
    pub real_time: f64,
    /// Processor time over that of a bare short-time transform of one size in one run (one forward, two inverse).
    pub times_stft: f64,
}

/// One way to play a scene.
#[derive(Clone, Debug)]
pub struct Setting {
    /// What it is called.
    pub name: String,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Tier and decodes.
    pub quality: Quality,
}

/// Measures every tier that the scene has, live decodes included, at a host rate and block size, on `seconds` of noise.
///
/// Processor time of the calling thread; medians of 5 runs that take turns with the bare transform.
#[must_use]
pub fn tier_costs(scene: &Arc<Scene>, sample_rate_hz: f64, block: usize, seconds: f64) -> Vec<TierCost> {
    let setting = |tier: Tier| Setting { name: tier.name().to_owned(), scene: Arc::clone(scene), quality: tier.into() };
    let settings: Vec<Setting> = scene.tiers().map(setting).collect();
    let costs = setting_costs(&settings.iter().collect::<Vec<_>>(), sample_rate_hz, block, seconds);
    costs.into_iter().flatten().collect()
}

/// Measures settings as [`tier_costs`] does tiers; `None` for a tier that only the scene's own rate has. All scenes have one
/// grid.
#[must_use]
pub fn setting_costs(settings: &[&Setting], sample_rate_hz: f64, block: usize, seconds: f64) -> Vec<Option<TierCost>> {
    let Some(first) = settings.first() else { return Vec::new() };
    let input = noise((seconds * sample_rate_hz) as usize);
    let played = input.len() as f64 / sample_rate_hz;
    let grid = first.scene.grid().at_rate(sample_rate_hz);
    let mut engines: Vec<Option<(Spatializer, Vec<f64>)>> = settings
        .iter()
        .map(|setting| {
            let tier = setting.quality.tier;
            let renderer =
                Renderer::new(Arc::clone(&setting.scene), RendererConfig::inline(&setting.scene, sample_rate_hz, tier, 1))
                    .ok()?;
            if renderer.played_tier(tier) != tier {
                return None;
            }
            let mut spatializer = Spatializer::new(sample_rate_hz);
            spatializer.install(Box::new(renderer));
            Some((spatializer, Vec::new()))
        })
        .collect();
    let (mut left, mut right, mut bare) = (vec![0.0; block], vec![0.0; block], Vec::new());
    for _ in 0..RUNS {
        bare.push(bare_stft(&grid, input.len() / grid.hop).0 / played);
        for (engine, setting) in engines.iter_mut().zip(settings) {
            let Some((spatializer, times)) = engine else { continue };
            let Quality { tier, live } = setting.quality;
            let params = BlockParams { tier, live, ..BlockParams::default() };
            let start = setting.scene.start_pose();
            let began = ThreadTime::now();
            for (b, x) in input.chunks(block).enumerate() {
                let out = [&mut left[..x.len()], &mut right[..x.len()]];
                spatializer.process(&[x], &[], out, &params, |i| walk(&start, (b * block + i) as f64 / sample_rate_hz));
            }
            times.push(began.elapsed().as_secs_f64() / played);
        }
    }
    let bare = median(bare).unwrap_or(f64::NAN);
    engines
        .into_iter()
        .zip(settings)
        .map(|(engine, setting)| {
            let real_time = median(engine?.1)?;
            Some(TierCost { tier: setting.quality.tier, real_time, times_stft: real_time / bare })
        })
        .collect()
}

/// Processor seconds of `frames` frames of one forward and two inverse transforms, and what has become of the noise that they
/// begin with.
fn bare_stft(grid: &StftGrid, frames: usize) -> (f64, Vec<f32>) {
    let (forward, inverse) = (promenade_fourier::forward::<f32>(grid.n_fft), promenade_fourier::inverse::<f32>(grid.n_fft));
    let mut time = noise(grid.n_fft);
    let mut spectrum = forward.make_output_vec();
    let mut scratch = vec![Default::default(); forward.get_scratch_len().max(inverse.get_scratch_len())];
    let scale = 1.0 / grid.n_fft as f32;
    let began = ThreadTime::now();
    for _ in 0..frames {
        for ear in 0..2 {
            if ear == 0 {
                let done = forward.process_with_scratch(&mut time, &mut spectrum, &mut scratch);
                debug_assert!(done.is_ok());
            }
            let mut kept = std::mem::take(&mut spectrum);
            kept[0].im = 0.0;
            kept[grid.n_fft / 2].im = 0.0;
            let done = inverse.process_with_scratch(&mut kept, &mut time, &mut scratch);
            debug_assert!(done.is_ok());
            spectrum = kept;
        }
        time.iter_mut().for_each(|v| *v *= scale);
    }
    let seconds = began.elapsed().as_secs_f64();
    (seconds, time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use promenade_testing::scenes::room;

    #[test]
    fn a_bare_transform_goes_there_and_back() {
        let grid = StftGrid { sample_rate_hz: 48_000.0, n_fft: 960, hop: 240 };
        let (_, returned) = bare_stft(&grid, 200);
        let off = returned.iter().zip(noise(960)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-4, "{off}");
    }

    #[test]
    fn all_tiers_are_held_against_one_bare_transform() {
        let scene = room(16_000.0, 0.2, 0.05);
        let costs = tier_costs(&scene, 16_000.0, 256, 0.5);
        assert_eq!(costs.iter().map(|c| c.tier).collect::<Vec<_>>(), scene.tiers().collect::<Vec<_>>());
        let bare = |cost: &TierCost| cost.real_time / cost.times_stft;
        assert!(costs.iter().all(|cost| (bare(cost) / bare(&costs[0]) - 1.0).abs() < 1e-9), "{costs:?}");
    }
}
