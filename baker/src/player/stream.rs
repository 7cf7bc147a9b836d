//! A scene as the plugin plays it, block by block.

use super::{Mix, Source, Write};
use cpu_time::ThreadTime;
use promenade_audio::FileError;
use promenade_core::decode::InlineWorker;
use promenade_core::{
    EmitterParams, Emitters, LiveParams, Pose, Quality, RenderError, RenderParams, Renderer, Scene, Tier, Trim,
};
use std::collections::VecDeque;
use std::sync::Arc;

/// A scene in one tier, from one emitter or two.
pub(super) struct StreamPlayer {
    emitters: Emitters,
    pub(super) params: RenderParams,
    places: EmitterParams,
    /// Processor seconds of the last sound, the decoding of its first pose not counted.
    pub(super) processor_s: f64,
}

impl StreamPlayer {
    pub(super) fn new(scene: &Arc<Scene>, rate_hz: f64, tier: Tier) -> Result<Self, RenderError> {
        let quality = Quality { tier, live: LiveParams { wait: true, ..LiveParams::default() } };
        Ok(Self {
            emitters: Renderer::for_tier(scene, rate_hz, tier)?.into(),
            params: RenderParams { quality, trim: Trim::NEUTRAL },
            places: EmitterParams::default(),
            processor_s: 0.0,
        })
    }

    /// The same with emitters of a stereo sound's channels this angle apart, radians.
    pub(super) fn with_spread(mut self, spread: f32) -> Result<Self, RenderError> {
        let first = self.emitters.first();
        let second = first.another()?;
        let decoder = if self.params.quality.tier >= Tier::High { InlineWorker::new(first.scene()) } else { None };
        let second = match decoder {
            Some(decoder) => second.with_worker(Box::new(decoder)),
            None => second,
        };
        self.emitters = self.emitters.with_second(second);
        self.places.spread = spread;
        Ok(self)
    }

    /// Whether the scene knows where its emitter is.
    pub(super) fn knows_emitter(&self) -> bool {
        self.emitters.first().scene().emitter().is_some()
    }

    /// Whether a stereo sound's channels have emitters of their own.
    pub(super) fn is_spread(&self) -> bool {
        self.places.spread > 0.0
    }

    pub(super) fn latency_samples(&self) -> usize {
        self.emitters.first().latency_samples()
    }

    fn tail_samples(&self) -> usize {
        self.emitters.first().tail_samples_with(&self.params.trim)
    }

    /// Seconds for which the room sounds on.
    pub(super) fn tail_s(&self) -> f64 {
        self.tail_samples() as f64 / self.emitters.first().grid().sample_rate_hz
    }

    /// Plays a sound from silence, and with `tail` the room that sounds on after it. The latency is rendered after the end and
    /// left out at the start.
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
        let emitters = &mut self.emitters;
        emitters.reset();
        self.processor_s = 0.0;
        let (latency, rate) = (emitters.first().latency_samples(), emitters.first().grid().sample_rate_hz);
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
            let input: Vec<&[f32]> = channels.iter().map(|channel| &channel[..]).collect();
            let pose_at = &mut |i| pose_at((done + i) as f64 / rate);
            emitters.process(&input, [left, right], self.params, &self.places, pose_at);
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
