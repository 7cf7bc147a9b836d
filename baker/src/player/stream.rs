//! A scene as the plugin plays it, block by block.

use super::{Mix, Source, Write, mono};
use cpu_time::ThreadTime;
use promenade_audio::FileError;
use promenade_core::{LiveParams, Pose, Quality, RenderError, RenderParams, Renderer, Scene, Tier, Trim};
use std::collections::VecDeque;
use std::sync::Arc;

/// A renderer in one tier.
pub(super) struct StreamPlayer {
    renderer: Renderer,
    pub(super) params: RenderParams,
    /// Processor seconds of the last sound, the decoding of its first pose not counted.
    pub(super) processor_s: f64,
}

impl StreamPlayer {
    pub(super) fn new(scene: &Arc<Scene>, rate_hz: f64, tier: Tier) -> Result<Self, RenderError> {
        let quality = Quality { tier, live: LiveParams { wait: true, ..LiveParams::default() } };
        Ok(Self {
            renderer: Renderer::for_tier(scene, rate_hz, tier)?,
            params: RenderParams { quality, trim: Trim::NEUTRAL },
            processor_s: 0.0,
        })
    }

    pub(super) fn latency_samples(&self) -> usize {
        self.renderer.latency_samples()
    }

    fn tail_samples(&self) -> usize {
        self.renderer.tail_samples_with(&self.params.trim)
    }

    /// Seconds for which the room sounds on.
    pub(super) fn tail_s(&self) -> f64 {
        self.tail_samples() as f64 / self.renderer.grid().sample_rate_hz
    }

    /// Plays a sound from silence, and with `tail` the room that sounds on after it. The latency is rendered after the end and left out
    /// at the start.
    pub(super) fn play(
        &mut self,
        mut source: Source,
        tail: bool,
        mix: Mix,
        block: usize,
        pose_at: &mut dyn FnMut(f64) -> Pose,
        write: &mut Write<'_>,
    ) -> Result<(), FileError> {
        let room = if tail { self.tail_samples() } else { 0 };
        let renderer = &mut self.renderer;
        renderer.reset();
        self.processor_s = 0.0;
        let (latency, rate) = (renderer.latency_samples(), renderer.grid().sample_rate_hz);
        let whole = source.frames() + room + latency;
        let mut channels = vec![Vec::new(); source.channels()];
        let mut waiting = [VecDeque::new(), VecDeque::new()];
        let mut ears = [Vec::new(), Vec::new()];
        let mut done = 0;
        while done < whole {
            // The first sample goes alone: its pose is decoded with it.
            let count = if done == 0 { 1 } else { block.min(whole - done) };
            source.fill(count, &mut channels)?;
            waiting.iter_mut().zip([channels.first(), channels.last()]).for_each(|(to, c)| to.extend(c.into_iter().flatten()));
            ears.iter_mut().for_each(|ear| ear.resize(count, 0.0));
            let [left, right] = &mut ears;
            let began = ThreadTime::now();
            renderer.process(&mono(&channels), [left, right], self.params, &mut |i| pose_at((done + i) as f64 / rate));
            if done > 0 {
                self.processor_s += began.elapsed().as_secs_f64();
            }
            let skip = latency.saturating_sub(done).min(count);
            mix.apply([&mut left[skip..], &mut right[skip..]], &mut waiting);
            write([&left[skip..], &right[skip..]])?;
            done += count;
        }
        Ok(())
    }
}
