//! Further sounds that are played in the room of the first, each from its place.

use super::source::{Source, mono};
use promenade_audio::FileError;
use promenade_core::glam::Vec3;
use std::collections::VecDeque;

/// Samples for which a sound stays at one place.
pub(super) const STEP: usize = 128;

/// A further sound and where it comes from.
pub struct Voice {
    sound: Source,
    /// How far it is from the scene's emitter, metres, at seconds from the sound's start.
    offset_at: Box<dyn Fn(f64) -> Vec3 + Send>,
    level: f32,
    channels: Vec<Vec<f32>>,
    mono: Vec<f32>,
}

impl Voice {
    /// Of a stereo sound the mean of both channels is played. `offset_at` is given seconds from its start and answers how far
    /// it is from the scene's emitter, metres.
    #[must_use]
    pub fn new(sound: Source, offset_at: impl Fn(f64) -> Vec3 + Send + 'static) -> Self {
        Self {
            level: 1.0,
            channels: vec![Vec::new(); sound.channels()],
            sound,
            offset_at: Box::new(offset_at),
            mono: Vec::new(),
        }
    }

    /// Sets the gain of its sound, linear.
    #[must_use]
    pub fn with_level(self, level: f32) -> Self {
        Self { level, ..self }
    }

    /// Samples per second.
    pub(super) fn sample_rate_hz(&self) -> u32 {
        self.sound.sample_rate_hz()
    }

    /// Samples of the sound.
    pub(super) fn frames(&self) -> usize {
        self.sound.frames()
    }

    /// Takes the next samples, and silence after the last. The dry sound waits in both ears.
    pub(super) fn fill(&mut self, count: usize, waiting: &mut [VecDeque<f32>; 2]) -> Result<(), FileError> {
        self.sound.fill(count, &mut self.channels)?;
        self.mono.clear();
        self.mono.extend(mono(&self.channels));
        for ear in waiting {
            let from = ear.len() - count;
            ear.range_mut(from..).zip(&self.mono).for_each(|(ear, x)| *ear += self.level * x);
        }
        Ok(())
    }

    /// What it plays of the samples that were taken, from one of them on, and where at so many seconds.
    pub(super) fn playing(&self, from: usize, seconds: f64) -> promenade_core::Voice<'_> {
        let input = &self.mono[from.min(self.mono.len())..];
        promenade_core::Voice { level: self.level, ..promenade_core::Voice::at(input, (self.offset_at)(seconds)) }
    }
}
