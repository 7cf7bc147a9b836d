//! Sound that is read, streamed through a scene and mixed block by block.

use super::mix::Mix;
use super::source::Source;
use super::voice::{STEP, Voice};
use crate::Stream;
use promenade_audio::FileError;
use promenade_core::Pose;
use std::collections::VecDeque;

/// Takes the next samples of both ears.
pub(super) type Write<'a> = dyn FnMut([&[f32]; 2]) -> Result<(), FileError> + 'a;

/// A sound that is played once, from silence.
pub(super) struct Playback<'a> {
    pub(super) source: Source,
    /// Further sounds.
    pub(super) voices: &'a mut [Voice],
    /// Whether the room sounds on after the end.
    pub(super) tail: bool,
    pub(super) mix: Mix,
    /// Samples at a time, at most.
    pub(super) block: usize,
}

impl Playback<'_> {
    /// Plays it through a stream. The latency is rendered after the end and left out at the start.
    pub(super) fn through(
        self,
        stream: &mut Stream,
        pose_at: &mut dyn FnMut(f64) -> Pose,
        write: &mut Write<'_>,
    ) -> Result<(), FileError> {
        let Self { mut source, voices, tail, mix, block } = self;
        let room = if tail { stream.tail_samples() } else { 0 };
        stream.restart();
        let frames = voices.iter().map(Voice::frames).fold(source.frames(), usize::max);
        let whole = frames + room + stream.renderer().latency_samples();
        let rate_hz = f64::from(source.sample_rate_hz());
        let mut channels = vec![Vec::new(); source.channels()];
        let mut waiting = [VecDeque::new(), VecDeque::new()];
        let mut ears = [Vec::new(), Vec::new()];
        let mut done = 0;
        while done < whole {
            // The first sample goes alone: its pose is decoded with it.
            let count = if done == 0 { 1 } else { block.min(whole - done) };
            source.fill(count, &mut channels)?;
            waiting.iter_mut().zip([channels.first(), channels.last()]).for_each(|(to, c)| to.extend(c.into_iter().flatten()));
            for voice in &mut *voices {
                voice.fill(count, &mut waiting)?;
            }
            ears.iter_mut().for_each(|ear| ear.resize(count, 0.0));
            let [left, right] = &mut ears;
            let (mut early, mut from) = (0, 0);
            while from < count {
                // Places change at the same samples whatever the blocks are.
                let step = if voices.is_empty() { count } else { STEP - (done + from) % STEP };
                let to = count.min(from + step);
                let input: Vec<&[f32]> = channels.iter().map(|channel| &channel[from..to]).collect();
                let seconds = ((done + from) / STEP * STEP) as f64 / rate_hz;
                let further: Vec<_> = voices.iter().map(|voice| voice.playing(from, seconds)).collect();
                early += stream.advance_further(&input, &further, [&mut left[from..to], &mut right[from..to]], pose_at);
                from = to;
            }
            mix.apply([&mut left[early..], &mut right[early..]], &mut waiting);
            write([&left[early..], &right[early..]])?;
            done += count;
        }
        Ok(())
    }
}
